"""The method as the paper prints it (Taneja et al. 2023, Eqs. 11-18), and its results beside the printed ones.

The method: `windowed` (predictions from a hidden state that starts at 0), `derivatives` (by the input t_n), `loss` (J),
`residual` (that of Eq. 38, in the readings that the paper leaves open), `joint_identification` (parameters that Adam
moves, Eqs. 37 and 41), `training` (what an epoch does).
The results: `one_step`, `bias` (what the residual itself finds), `tables`, `figures`, `page`.
"""
