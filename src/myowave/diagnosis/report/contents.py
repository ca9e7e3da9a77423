"""Names of the tables and pictures of a diagnosis, in the order in which they are read.

The workflow names its files by them at every start, so nothing heavy is imported here.
"""

TABLE_NAMES = ("ladder", "ranking", "parameters", "errors", "misfit", "missing_torque")
# Of the rule that compares models with trials, after the fits.
COMPARISON_NAMES = ("torque", "horizons")
FIGURE_NAMES = ("glance", *COMPARISON_NAMES, "missing_torque", "ranking", "ladder")
