"""Musculoskeletal forward dynamics of a hinge joint: muscles, joint, effects, and the motion they produce.

Read in this order: `constants`, `curves`, `path` and `muscle` (one muscle), `joint` (the forearm), `effect` (what may
be added), `model` (their sum), `valued` (with values for its parameters), `dynamics` (the equation of motion),
`simulation` (a model with all that drives it, from EMG to activation), `motion` (integration in time), `tangent` (the
derivatives of a step), `trajectory` (the same motion for all samples at once, with sensitivities). Everything is
batched, double precision torch.
"""
