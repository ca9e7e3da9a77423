"""Numbers as text: as many digits as their error leaves, and the same for one fact wherever it stands."""

import numpy as np
import pandas as pd

LEAST_DEG, MOST_DEG = 0.001, 1000.0  # no smaller or larger error is told
LEAST_R2 = -99.0
Z95 = 1.96  # half a 95 % interval in standard errors
ANYWHERE = (-np.inf, np.inf)
NOTHING = 1e-9  # a smaller share of a value is no scatter but rounding


def degrees(value: float | None) -> str:
    """An error in text; no power of ten for one that nobody could measure, None of a motion that overflows."""
    if value is None or value > MOST_DEG:
        return f"over {MOST_DEG:.0f} deg"
    return f"under {LEAST_DEG} deg" if value < LEAST_DEG else f"{two_digits(value)} deg"


def two_digits(value: float) -> str:
    """A number in text, with two significant digits and no power of ten for large ones; tables have one digit more."""
    if 1 <= abs(value) < 9.95:
        return f"{value:.1f}"
    return f"{value:#.2g}" if abs(value) < 1 else f"{value:.0f}"


def signed(value: float) -> str:
    """A change, with two digits."""
    return "+" * (value > 0) + two_digits(value)


def number(value: float | None) -> str:
    """Three digits, no power of ten for thousands; empty where there is none."""
    if value is None or pd.isna(value):
        return ""
    if not np.isfinite(value):
        return "runs away"
    return f"{value:.0f}" if 1000 <= abs(value) < 1e6 else f"{value:.3g}"


def r2_text(value: float) -> str:
    """R2 in two digits, or as many as tell it from 1; empty where there is none."""
    if np.isnan(value):
        return ""
    if value > 0.99995:
        return "over 0.9999"
    if value < LEAST_R2:
        return f"under {LEAST_R2:.0f}"
    return f"{value:.2f}" if value < 0.995 else f"{value:.4f}"


def estimate(value: float, se: float | None, bounds: tuple[float, float] = ANYWHERE) -> str:
    """A value with its standard error, if there is one, to the digits that this leaves; one that may be anywhere within
    its bounds is not known."""
    if se is None or not np.isfinite(se) or se <= 0:
        return f"{value:.4g}"
    if value - Z95 * se <= bounds[0] and value + Z95 * se >= bounds[1]:
        return f"{value:.4g}, not known"
    if se < NOTHING * abs(value):
        return f"{value:.6g}"
    digits = max(0, 1 - int(np.floor(np.log10(se))))
    return f"{value:z.{digits}f} ± {se:.{digits}f}" if digits <= 6 else f"{value:.6g} ± {se:.1g}"
