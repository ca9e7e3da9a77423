"""Recipes of method `rollout`: networks fed by their own predictions.

`rollout` is the definition in plain torch, `fast` the same map several times as fast, `loss` what an epoch measures,
`training` what it does, `augmentation` motion simulated on EMG that nobody recorded.
"""
