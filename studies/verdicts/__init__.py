"""How often the diagnosis is right, on simulated arms that the model does not assume."""
