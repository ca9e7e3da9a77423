"""What does a fit leave: noise, what muscle curves of another shape would do, or more? And how large is the noise?

Each question has one function here, which the search and the verdict ask.
"""

from dataclasses import dataclass

import numpy as np

from myowave.diagnosis.evidence import EVIDENCE, delta_bic
from myowave.diagnosis.misfit.filtered import noise_left
from myowave.diagnosis.misfit.own_curves import integrate_out_curves
from myowave.diagnosis.misfit.repeated import Repeated, repeated_misfit
from myowave.diagnosis.misfit.size import Size, size_of, size_of_misfit
from myowave.identification.disturbance import Disturbance
from myowave.identification.noise import SMALLEST_NOISE_DEG, correlation_time, is_bound
from myowave.identification.output_error import Fit
from myowave.identification.record import Record
from myowave.identification.whitening import MotionBand

ROUGHLY = 3.0  # times what noise gives: a random force is not exactly as assumed, and leaves a little
NOTHING = 0.3  # of the noise, or of what a filter leaves of it: less raises the error by less than 5 %, and is nothing


@dataclass(frozen=True)
class Left:
    """What a fit leaves.

    Args:
        size: of its misfit.
        slow: see `Size.certain`; given a random force, if there is one, and 0 for what such a force may leave.
        repeated: see `misfit.repeated`.
        only_noise: whether it is noise, given that force.
        of_curves: where it is not, whether it would be with muscle curves of another shape.
    """

    size: Size
    slow: float
    repeated: Repeated
    only_noise: bool = True
    of_curves: bool = False

    @property
    def certain(self) -> float:
        """What is certainly left, slow or repeated in all trials, in variances of independent samples."""
        return max(self.repeated.certain, self.slow)

    def missing(self, fit: Fit) -> float:
        """Root mean square of it [rad]."""
        return max(self.size.missing, self.repeated.size(fit))


def what_is_left(fit: Fit, disturbance: Disturbance | None = None, *, has_effects: bool) -> Left:
    """What a fit leaves.

    Args:
        disturbance: the random force that the fit takes for a part of the noise.
        has_effects: whether it has effects that were found. Whatever is left beside one counts against it; a model
            without any may leave next to nothing.
    """
    size = size_of_misfit(fit)
    if disturbance is not None:
        given_force = size_given_force(fit, disturbance)
        repeated = repeated_misfit(fit, given_force)
        repeats = repeated.significant and repeated.size(fit) > 0 and repeated.gain > ROUGHLY * repeated.freedom
        slow = given_force.certain if given_force.significant and given_force.ratio > ROUGHLY else 0.0
        return Left(size, slow, repeated, only_noise=not (slow or repeats))
    repeated = repeated_misfit(fit, size)
    noise = min(size.noise, max(fit.rmse(), np.radians(SMALLEST_NOISE_DEG)))
    nothing = 0.0 if has_effects else NOTHING * noise
    repeats = repeated.significant and repeated.size(fit) > nothing
    only_noise = not repeats and not (size.significant and size.missing > nothing)
    of_curves = not only_noise and goes_with_curves(fit, size)
    return Left(size, size.certain, repeated, only_noise, of_curves)


def size_given_force(fit: Fit, disturbance: Disturbance) -> Size:
    """How large what a fit leaves given a random force is; in a band, beside the noise that was seen above it."""
    known = disturbance.angle if isinstance(fit.record.filter, MotionBand) else None
    return size_of(fit.normal.residual, fit.angle, fit.record, fit.normal.fitted, known)


def goes_with_curves(fit: Fit, size: Size) -> bool:
    """Whether a fit that leaves more than noise would leave no more with muscle curves of another shape, and what these
    explain is worth their freedom.

    Args:
        size: of the fit's misfit.
    """
    if fit.record.pieces is not None:
        return False
    curves = integrate_out_curves(fit, size.noise**2)
    # Behind a filter normal equations hold only what is slow, and the noise is seen above.
    residual = fit.residual + curves.normal.residual - fit.normal.residual
    left = size_of(residual, fit.angle, fit.record, curves.normal.fitted)
    samples = fit.record.samples / correlation_time(curves.normal.residual, fit.record.samples)
    worth = delta_bic(fit, fit.objective - curves.drop, 0, samples) - curves.occam
    return worth > EVIDENCE and not left.significant and not repeated_misfit(fit, left, curves.normal).significant


def angle_noise_deg(fit: Fit, left: Left, disturbance: Disturbance | None, record: Record, *, follows: bool) -> float:
    """Noise of the angle [deg], without what noise of the EMG does; of a filtered angle what the filter has left of it.

    Args:
        record: all trials.
        follows: whether the base model follows them; what one leaves that is so far off is not noise.
    """
    if not follows:
        return float(np.degrees(record.noise))
    white = left.size.noise if disturbance is None else disturbance.angle
    filtered = isinstance(fit.record.filter, MotionBand) and not is_bound(float(np.degrees(white)))
    return float(np.degrees(noise_left(fit, white) if filtered else white))
