"""Noise of the recorded EMG: something else drove the muscles than what was recorded, and the motion wanders.

Such noise drives the arm where no model can, so the difference between the measured and the simulated motion is the
arm's answer to a force that nobody recorded. Along the fitted motion that answer is linear. A Kalman filter tells how
likely a residual is for noise of the angle and noise of the EMG of any size, and turns residual and derivatives into
innovations, which are white again: a fit to these is the prediction-error method (Ljung, System Identification, 2nd
ed., Secs. 7.2, 10.6), and weighs every sample by what is not noise in it. Where an angle has
passed a filter only its slow waves count: their amplitudes are made white by their covariance.

Shapes: T trials, N samples, K numbers of the state, M muscles, C columns, W waves.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from myowave.identification.least_squares import scaled_slope, without_starts
from myowave.identification.output_error import Fit
from myowave.identification.spectrum import ABOVE, Spectra, covariance
from myowave.identification.whitening import Filter, MotionBand, Whitener
from myowave.physics.effect import Effect
from myowave.physics.effects.emg_offset import EFFECT as EMG_OFFSET
from myowave.physics.trajectory import forcing_of

Array = NDArray[np.float64]

USUAL = 0.05  # noise of an EMG between 0 and 1 [-]
REACH = 1e-4  # step of the differences
REACH_OF_NOISE = 6.0  # times the edge of the motion: so far the noise of a filtered angle is estimated
EFFORT = {"xatol": 0.02, "fatol": 0.1, "maxiter": 80}


@dataclass(frozen=True)
class Disturbance:
    """Noise of the angle and of the EMG that make a residual most likely.

    Args:
        emg: standard deviation of every channel at every sample [-].
        angle: of the angle [rad].
        gain: how much more likely the residual is with noise of the EMG than without, as a difference of BIC.
        whitener: turns residuals of these trials into innovations.
        response: by how much a standard deviation of 1 of the EMG's noise would move the angle, root mean square over
            all samples [rad].
    """

    emg: float
    angle: float
    gain: float
    whitener: Filter
    response: float = 0.0

    @property
    def motion(self) -> float:
        """How far the simulated motion is off because the recorded EMG is noisy, root mean square [rad]."""
        return self.emg * self.response


def estimate_disturbance(fit: Fit) -> Disturbance:
    """Noise of the EMG that a fit's residual calls for; of a fit to the band of the motion, in that band."""
    # ASSUME: noise is white from sample to sample, as strong in all channels, and small enough for a linear answer.
    forcing, jacobian = excitation_forcing(fit), fit.linear.jacobian.numpy()
    estimate = _of_filtered if isinstance(fit.record.filter, MotionBand) else _of_unfiltered
    angle, emg, gain, whitener = estimate(fit, jacobian, forcing)
    response = wandering(jacobian, forcing @ np.swapaxes(forcing, -1, -2), fit.record.valid)
    return Disturbance(emg, angle, gain, whitener, response)


def _of_unfiltered(fit: Fit, jacobian: Array, forcing: Array) -> tuple[float, float, float, Filter]:
    """Noise of the angle and of the EMG, the gain and the filter of `Disturbance`, of an angle as the sensor gave it.

    Args:
        jacobian, forcing: of the steps of the fit's motion, (T, N - 1, K, K) and (T, N - 1, K, M).
    """
    added = forcing @ np.swapaxes(forcing, -1, -2)
    residual, samples, valid = fit.residual, fit.record.samples, fit.record.valid

    def whitener(logs: Array) -> Whitener:
        angle, emg = np.exp(logs)
        return Whitener.of(jacobian, emg**2 * added, float(angle))

    def unlikely(logs: Array) -> float:
        return whitener(logs).unlikely(residual, valid)

    found = minimize(unlikely, np.log([fit.record.noise, USUAL]), method="Nelder-Mead", options=EFFORT)
    angle, emg = np.exp(found.x)
    # The fit may have been made given another force, which leaves its trials to start wherever they like.
    by_start = scaled_slope(fit.sensitive.by_start, 1.0, valid)[..., : 1 if fit.record.at_rest else 2]
    left = without_starts(by_start, residual[..., None])
    without = samples * (np.log((left**2).sum() / samples) + 1)
    gain = without - float(found.fun) - np.log(samples)
    return float(angle), float(emg), float(gain), whitener(found.x)


def _of_filtered(fit: Fit, jacobian: Array, forcing: Array) -> tuple[float, float, float, Filter]:
    """The same of an angle that has passed a low-pass filter: what is above the band tells how strong its noise was,
    and the filter has taken some of that.

    Args:
        jacobian, forcing: as above; the fit's own filter is the band.
    """
    band = fit.record.filter
    assert isinstance(band, MotionBand)
    spectra = Spectra.of(fit, forcing, band.edge / ABOVE[0], REACH_OF_NOISE)
    without, found = (spectra.most_likely(forced=forced, filtered=True) for forced in (False, True))
    gain = without.unlikely - found.unlikely - np.log(spectra.residual.size)
    force = found.emg**2 * covariance(jacobian, forcing, band.waves)
    return found.noise, found.emg, gain, band.given_force(force, found.noise)


def wandering(jacobian: Array, added: Array, valid: NDArray[np.bool_]) -> float:
    """How far a random force takes the angle from where it would be without, root mean square over samples [rad].

    Args:
        jacobian, added: as `Whitener.of` takes them; the motion starts where it would without the force.
        valid: samples that count (T, N).
    """
    trials, steps, states, _ = jacobian.shape
    spread, variance = np.zeros((trials, states, states)), np.zeros((trials, steps + 1))
    for n in range(steps):
        step = jacobian[:, n]
        spread = step @ spread @ np.swapaxes(step, -1, -2) + added[:, n]
        variance[:, n + 1] = spread[:, 0, 0]
    return float(np.sqrt(variance[valid].mean()))


def excitation_forcing(fit: Fit) -> Array:
    """What 1 more in each muscle's excitation adds to the state within a step, (T, N - 1, K, M)."""
    return -forcing_by(fit, EMG_OFFSET, -REACH)  # an offset takes away


def forcing_by(fit: Fit, effect: Effect, reach: float = REACH) -> Array:
    """What 1 in each parameter of an effect adds to the state within a step of a fit's motion, (T, N - 1, K, P).

    Args:
        effect: without a state; the model may have it already. One that the model refuses adds nothing, P = 0.
        reach: step of the differences.
    """
    if fit.model.refuses(effect):
        return np.zeros((*fit.linear.after.shape, 0))
    probe = replace(effect, name=f"{effect.name}_more")
    model = fit.model.with_effects([probe])
    simulation = fit.record.simulation(model, fit.params)
    return forcing_of(simulation, fit.linear, dict.fromkeys(model.parameters_of(probe), 1.0), reach).numpy()
