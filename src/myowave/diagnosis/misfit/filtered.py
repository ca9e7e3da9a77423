"""Has the angle passed a filter?

What a random force or a missing effect does to an angle falls off steadily, as an arm is slow, and noise of the sensor
goes on behind it until a filter ends it. Whatever a fit misses, its finest scales alone do not show a filter: there is
little in them of any smooth residual.
"""

import numpy as np

from myowave.data.wavelets import estimate_noise
from myowave.diagnosis.misfit.size import Size
from myowave.identification.disturbance import Disturbance, excitation_forcing
from myowave.identification.output_error import Fit
from myowave.identification.spectrum import Spectra
from myowave.identification.whitening import MotionBand

WHITE = 0.8  # of the noise in the band of the motion: less in the finest scales may be a filter's doing
REACH = 14.0  # times the edge of the motion: so far filters of motion capture are looked for
# Twice the difference of log-likelihoods: filters of 4 to 12 Hz gave 47 and more in three trials of 200 samples, and
# hundreds in four of 500; what effects and noise of the EMG leave without a filter at most 3 beside 0.5 deg of noise, 6
# beside 0.05 and 11 without any.
EVIDENCE = 25.0


def evidence_of_a_filter(fit: Fit, size: Size) -> float:
    """How much more likely the spectra of a fit's trials are with a filter that lets their motion through than without:
    twice the difference of log-likelihoods, each beside the random force and the noise that make it largest.

    Args:
        size: of the fit's misfit.
    """
    if size.edge_hz == 0:
        return 0.0  # nothing moves, so no filter can have let a motion through
    spectra = Spectra.of(fit, excitation_forcing(fit), size.edge_hz * fit.record.dt, REACH)
    without, with_one = (spectra.most_likely(forced=True, filtered=filtered) for filtered in (False, True))
    return without.unlikely - with_one.unlikely


def has_passed_a_filter(fit: Fit, size: Size) -> bool:
    """Whether that evidence is strong."""
    return evidence_of_a_filter(fit, size) > EVIDENCE


def lacks_noise(fit: Fit, disturbance: Disturbance) -> bool:
    """Whether the finest scales of what a fit leaves lack noise even with the colour taken out that a force gives: then
    it is no force's doing, and white noise is not there to weigh it by.

    Args:
        disturbance: the random force and the white noise that make the residual most likely.
    """
    new = disturbance.whitener.innovations(fit.residual[..., None])[..., 0]
    return estimate_noise(*fit.record.joined(new).values()) < WHITE * disturbance.angle


def noise_left(fit: Fit, white: float) -> float:
    """Noise of an angle that has passed a filter [rad]: what there was in the motion's band, and what is left above.

    Args:
        fit: by what is slow.
        white: standard deviation before the filter [rad].
    """
    band, record = fit.record.filter, fit.record
    assert isinstance(band, MotionBand)
    within = white**2 * record.values / record.samples
    rest = fit.residual - (band.waves @ band.amplitudes(fit.residual[..., None]))[..., 0]
    above = float((rest**2)[record.valid].mean())
    return float(np.sqrt(within + above))
