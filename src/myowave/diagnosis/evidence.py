"""How much better one model describes the data than another, paid for its parameters: the one measure of evidence.

Evidence is a difference of BIC: n ln(RSS without / RSS with) - k ln n, with n the number of *independent* samples of
the residual that the better model leaves. While a model misses something, its residual is slow, a few seconds of it
are worth few samples, and nothing is decided by thousands of them.
"""

import numpy as np

from myowave.identification.noise import SMALLEST_NOISE_DEG, correlation_time
from myowave.identification.output_error import Fit

EVIDENCE = 10.0  # difference of BIC that counts as very strong (Kass & Raftery 1995)
MARGIN = 6.0  # between two effects, below which they are not told apart (strong: odds of 20 to 1)


def independent_samples(fit: Fit) -> float:
    """Number of independent samples of a fit's residual."""
    return fit.record.samples / correlation_time(fit.normal.residual, fit.record.samples)


def delta_bic(fit: Fit, objective: float, parameters: int, samples: float) -> float:
    """Difference of BIC in favour of `parameters` more that lower a fit's objective to this [rad^2]."""
    floor = fit.record.samples * np.radians(SMALLEST_NOISE_DEG) ** 2
    return float(samples * np.log((fit.objective + floor) / (objective + floor)) - parameters * np.log(samples))
