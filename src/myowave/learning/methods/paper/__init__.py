"""Recipes of method `paper`: as the paper prints it (Taneja et al. 2023, Eqs. 11-18).

`one_step` (predictions from measured angles), `residual` (of the equation of motion, Eq. 38, in the
readings that the paper leaves open), `joint_identification` (parameters that Adam moves, Eqs. 37 and 41), `training`.
"""
