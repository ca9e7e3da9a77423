"""Musculoskeletal forward dynamics of a hinge joint: muscles, joint, effects, and the motion they produce.

Read in this order: `curves` and `muscle` (one muscle), `joint` (the forearm), `effect` (what may be added),
`model` (their sum), `motion` (integration in time), `trajectory` (the same motion for all samples at once, with
sensitivities). Everything is batched, double precision torch.
"""
