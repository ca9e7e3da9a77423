"""Networks from EMG to motion, trained scale by scale, with the parameters of the physics identified beside them.

Read in this order: `network` and `prediction` (what the network is), `windows` (what trains and what validates), `task`
(what is trained), `training` (the loop: a generator of epoch reports), `methods` (which one trains which recipe:
`rollout` or `paper`). `identification` is what physics gives to them. Training leaves a `checkpoint`, used by
`prediction`, `evaluation` and `streaming` (one sample at a time). `sweep` searches for better settings.
"""
