"""Is what a fit leaves repeated from trial to trial? Then it follows from what was recorded: physics can explain it.

A general correction of the model, a torque of angle, velocity, acceleration and activation, an excitation that depends
on the recorded ones in other ways and an angle that is off, is estimated for all trials together. What it explains
beyond chance is structure; what it cannot explain is noise, or comes from something nobody recorded.

Shapes: T trials, N samples, K numbers of the state, M muscles, C columns, P parameters.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.stats import chi2
from torch import Tensor

from myowave.diagnosis.misfit.size import Size
from myowave.diagnosis.misfit.terms import OF_SENSOR, torque_terms
from myowave.identification.disturbance import excitation_forcing, forcing_by
from myowave.identification.least_squares import Normal, gain_of
from myowave.identification.output_error import Fit
from myowave.physics.effects.constant_torque import EFFECT as CONSTANT_TORQUE
from myowave.physics.trajectory import recur

Array = NDArray[np.float64]

ACCELERATION = "qddot"
LAGS_S = (-0.16, -0.08, 0.08, 0.16, 0.3)  # of excitation, ahead and behind
SIGNIFICANCE = 0.005


@dataclass(frozen=True)
class Repeated:
    """What one general correction for all trials explains of a residual.

    Args:
        gain: how much the sum of squares falls, in variances of independent samples [-].
        freedom: what it would fall by for noise, on average [-].
        variance: of an independent sample [rad^2].
    """

    gain: float
    freedom: float
    variance: float

    @property
    def significant(self) -> bool:
        """Whether something is left that the same correction explains in all trials."""
        return bool(chi2.sf(self.gain, max(self.freedom, 1.0)) < SIGNIFICANCE)

    def size(self, fit: Fit) -> float:
        """Root mean square of what it explains beyond chance [rad]."""
        return float(np.sqrt(self.excess * self.variance / fit.record.samples))

    @property
    def excess(self) -> float:
        """What it falls by beyond that, in variances of independent samples [-]."""
        return max(self.gain - self.freedom, 0.0)

    @property
    def certain(self) -> float:
        """The same less a standard deviation of what noise gives."""
        return max(self.excess - float(np.sqrt(2 * self.freedom)), 0.0)


def repeated_misfit(fit: Fit, size: Size, normal: Normal | None = None) -> Repeated:
    """Try a general correction of a fitted model, the same for all trials.

    Args:
        size: of the same fit.
        normal: the fit's normal equations with more parameters, and what these leave.
    """
    normal = fit.normal if normal is None else normal
    columns = np.stack([*corrections(fit).values()], -1)
    columns = columns / np.sqrt((columns**2).mean((0, 1))).clip(1e-300)
    # What the fitted parameters can do has been done: the rest of each part of the correction is what it can add.
    (signal, _), left = normal.beyond(columns), normal.left
    variance = normal.variance(fit.record.samples)
    # ASSUME: no part of the correction makes more than the whole misfit does.
    gain = gain_of(signal.T @ signal, signal.T @ left, prior=variance / max(float((left**2).mean()), 1e-300))
    return Repeated(gain.fall / variance, gain.freedom, variance)


def corrections(fit: Fit) -> dict[str, Array]:
    """What each part of the general correction does to what counts of the angle, the starts of the trials fitted,
    (T, N), by what it is in words."""
    pushes = correcting_pushes(fit)
    moved = np.moveaxis(moved_by(fit, np.stack([*pushes.values()], -1)), -1, 0)
    return {**dict(zip(pushes, moved, strict=True)), **_by_sensor(fit)}


def correcting_pushes(fit: Fit) -> dict[str, Array]:
    """What each part of the general correction that drives the arm adds to the state within a step, (T, N - 1, K)."""
    return {**_by_torque(fit), **_by_excitation(fit)}


def moved_by(fit: Fit, pushes: Array) -> Array:
    """What changes of the state within each step, (T, N - 1, K, C), do to what counts of the angle, the starts of the
    trials fitted, (T, N, C)."""
    jacobian = fit.linear.jacobian
    start = jacobian.new_zeros(*jacobian.shape[:-3], jacobian.shape[-1], pushes.shape[-1])
    answer = recur(jacobian, torch.from_numpy(pushes), start)[..., 0, :].numpy() * fit.record.valid[..., None]
    return fit.normal.without_starts(fit.record.white(answer))


def along_steps(fit: Fit) -> tuple[Tensor, Tensor, Tensor]:
    """Angle and velocity of a fit's motion (T, N - 1) and its activations (T, N - 1, M) where each step begins."""
    q, v = fit.sensitive.motion.state[:, :-1, :2].unbind(-1)
    return q, v, fit.simulation.drive.activation[..., 0, :].expand(*q.shape, -1)


def _of_excitations(names: Sequence[str], own: int) -> dict[str, Callable[[Tensor], Tensor]]:
    """What one muscle's excitation may be more by, of those of all (..., M), by how it is written."""
    parts: dict[str, Callable[[Tensor], Tensor]] = {
        "a constant": lambda u: torch.ones_like(u[..., own]),
        "its square": lambda u: u[..., own] ** 2,
    }
    others = (other for other in range(len(names)) if other != own)
    return parts | {f"that of {names[other]}": itemgetter((..., other)) for other in others}


def _middle(fit: Fit) -> float:
    return float(fit.record.angle[fit.record.valid].mean())


def _torque_like(term: str) -> str:
    return f"a torque like {term}"


def _angle_that_is(text: str) -> str:
    return f"an angle that is {text}"


def _excitation_like(muscle: str, what: str) -> str:
    return f"excitation of {muscle} like {what}"


def _by_torque(fit: Fit) -> dict[str, Array]:
    """Changes of the state within a step by torques of the joint's state and the activations, (T, N - 1, K) each."""
    forcing = forcing_by(fit, CONSTANT_TORQUE)
    q, v, activation = along_steps(fit)
    names = [muscle.name for muscle in fit.model.muscles]
    parts = {text: term(q, v, activation).numpy() for text, term in torque_terms(names, _middle(fit)).items()}
    integral = (activation * activation.cumsum(-2) * fit.record.dt).numpy()
    parts |= {f"a_{name} times its integral": integral[..., i] for i, name in enumerate(names)}
    parts[ACCELERATION] = np.diff(fit.sensitive.motion.state[..., 1].numpy(), axis=-1) / fit.record.dt
    return {_torque_like(text): forcing[..., 0] * part[..., None] for text, part in parts.items()}


def _by_excitation(fit: Fit) -> dict[str, Array]:
    """The same by excitations that are late, early, off, bent, or those of other muscles."""
    forcing = excitation_forcing(fit)
    excitation = fit.simulation.drive.excitation[..., 0, :].expand(*forcing.shape[:2], -1)
    return {
        name: forcing[..., muscle] * signal[..., None]
        for muscle in range(forcing.shape[-1])
        for name, signal in _signals(fit, excitation, muscle)
    }


def _signals(fit: Fit, excitation: Tensor, muscle: int) -> Iterator[tuple[str, Array]]:
    names, own = [m.name for m in fit.model.muscles], excitation[..., muscle].numpy()
    samples = np.arange(own.shape[1])
    for lag in LAGS_S:
        shifted = (samples - round(lag / fit.record.dt)).clip(0, len(samples) - 1)
        when = f"{abs(lag):g} s {'late' if lag > 0 else 'early'}"
        yield f"a part of the excitation of {names[muscle]} {when}", own[:, shifted] - own
    for text, part in _of_excitations(names, muscle).items():
        yield _excitation_like(names[muscle], text), part(excitation).numpy()


def _by_sensor(fit: Fit) -> dict[str, Array]:
    """What a sensor that is off or late does to what counts of the angle, (T, N) each."""
    q, v = fit.sensitive.motion.state[..., :2].unbind(-1)
    parts = np.stack([term(q, v).numpy() for term, _ in OF_SENSOR.values()], -1)
    seen = fit.normal.without_starts(fit.record.white(parts * fit.record.valid[..., None]))
    return {_angle_that_is(text): seen[..., n] for n, text in enumerate(OF_SENSOR)}
