"""Has the angle passed a filter?

Noise of a sensor is as dense at all frequencies; behind a low-pass filter it still is where the arm moves and just
above, and next to nothing is left of it in the finest scales. What a random force or a missing effect does to an angle
falls off steadily, as an arm is slow. Whatever a fit misses, its finest scales alone do not tell the two apart: a force
explains any smooth residual.

Shapes: T trials, N samples, K numbers of the state, M muscles, D draws.
"""

import numpy as np
from scipy.optimize import minimize

from myowave.data.wavelets import estimate_noise
from myowave.diagnosis.misfit.repeated import moved_by
from myowave.diagnosis.misfit.size import ABOVE, Size, spectrum
from myowave.identification.disturbance import Disturbance, excitation_forcing
from myowave.identification.output_error import Fit

WHITE = 0.8  # of the noise in the band of the motion: less in the finest scales may be a filter's doing
WEAK = 0.5  # of the noise just above that band: as little in the finest scales is
EVIDENCE = 10.0  # twice a difference of log-likelihoods that counts as very strong
DRAWS = 30  # of a random force, to see the spectrum of what it does
FAINT = 0.05  # of the noise of the EMG: a second start of the search


def has_passed_a_filter(fit: Fit, size: Size, disturbance: Disturbance) -> bool:
    """Whether the angle of a fit's trials has passed a filter that lets its motion through.

    Args:
        size: of the fit's misfit.
        disturbance: the random force and the white noise that make its residual most likely.
    """
    # Where the finest scales lack noise even with the colour taken out that a force gives, it is no force's doing.
    new = disturbance.whitener.innovations(fit.residual[..., None])[..., 0]
    if estimate_noise(*fit.record.joined(new).values()) < WHITE * disturbance.angle:
        return True
    noise, gain = noise_above(fit, size, disturbance)
    return gain > EVIDENCE and disturbance.angle < WEAK * noise


def noise_above(fit: Fit, size: Size, disturbance: Disturbance) -> tuple[float, float]:
    """Noise of the angle, as if it were white, up to just above the band of the motion, beside a random force; and how
    much more likely it makes the residual there than the noise of the finest scales does.

    Returns:
        Standard deviation [rad], and twice the difference of log-likelihoods. Source: Whittle 1953, Estimation and
        information in stationary time series.
    """
    forcing = excitation_forcing(fit)
    drawn = np.random.default_rng(0).standard_normal((*forcing.shape[:2], forcing.shape[-1], DRAWS))
    answers = moved_by(fit, np.einsum("tnkm,tnmd->tnkd", forcing, drawn))
    frequency, observed = spectrum(fit.residual, fit.record)
    by_force = np.mean([spectrum(answer, fit.record)[1] for answer in np.moveaxis(answers, -1, 0)], axis=0)
    counts = (frequency > 0) & (frequency <= ABOVE[1] * size.edge_hz)
    observed, by_force = observed[counts], by_force[counts]

    def unlikely(noise: float, emg: float) -> float:
        density = noise**2 + emg**2 * by_force
        return float(2 * (np.log(density) + observed / density).sum())

    finest, force = np.log(disturbance.angle), np.log(disturbance.emg)
    alone = minimize(lambda logs: unlikely(disturbance.angle, *np.exp(logs)), [force], method="Nelder-Mead")
    starts = [(noise, emg) for noise in (finest, np.log(size.noise)) for emg in (force, force + np.log(FAINT))]
    both = [minimize(lambda logs: unlikely(*np.exp(logs)), start, method="Nelder-Mead") for start in starts]
    best = min(both, key=lambda found: found.fun)
    return float(np.exp(best.x[0])), float(alone.fun - best.fun)
