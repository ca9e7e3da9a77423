"""Networks from EMG to motion, trained scale by scale, with the parameters of the physics identified beside them.

Read in this order: `network` and `cells` (what the network is), `rollouts.rollout` (how it predicts), `windows` (what
trains and what validates), `task` (what is trained), `training` (the loop: a generator of epoch reports), `methods`
(which method trains which recipe). `rollouts` is the method of recipe `rollout`, `paper` the one that the paper
prints; `identification` (or `unidentified`: none) and `augmentation` are what physics gives to them. Training leaves a
`checkpoint`, used by `prediction`, `evaluation` and `streaming` (one sample at a time). `sweep` searches for better
settings; `multiresolution` compares ways to go through the scales.
"""
