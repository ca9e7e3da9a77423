"""Recipes of method `paper`: as the paper prints it (Taneja et al. 2023, Eqs. 11-18)."""
