"""Terms of what a model may lack in general are what they are called."""

import math

import pytest
import torch

from myowave.diagnosis.likelihood.terms import torque_terms


def test_terms_are_what_they_are_called():
    q, v, a = torch.tensor(0.5), torch.tensor(-2.0), torch.tensor([0.3, 0.8])
    of_motion = {"1": 1, "q": 0.5, "q^2": 0.25, "sin(2 q)": math.sin(1), "qdot": -2, "qdot |qdot|": -4}
    of_motion |= {"the sign of qdot": -1, "q qdot": -1}
    parts = {"": 1, "^2": None, " q": 0.5, " q^2": 0.25, " qdot": -2, " qdot |qdot|": -4, " the sign of qdot": -1}
    expected = {
        f"a_{muscle}{name}": own * own if factor is None else own * factor
        for muscle, own in (("Bi", 0.3), ("Tri", 0.8))
        for name, factor in parts.items()
    }
    middle = 1.5
    found = {name: float(term(q + middle, v, a)) for name, term in torque_terms(["Bi", "Tri"], middle).items()}
    assert found == pytest.approx(of_motion | expected)
