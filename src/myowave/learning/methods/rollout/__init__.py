"""Recipes of method `rollout`: networks fed by their own predictions."""
