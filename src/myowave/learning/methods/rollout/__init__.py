"""Recipes of method `rollout`: networks fed by their own predictions.

`training` is what an epoch does, `fast` the rollout of `prediction` several times as fast, `augmentation` motion
simulated on EMG that nobody recorded.
"""
