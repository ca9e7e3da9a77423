"""Score test of an effect that a fitted model lacks: what would it gain, seen from where the fit stands?

The derivative of the motion by the effect's parameters at 0, with all that the free parameters and the trials' starts
could imitate taken out, is what only the effect can do. Its product with the residual says how much the sum of
squares would fall, without a fit of the richer model. What is left of the derivative (the *visible share*) says
whether these data can show the effect at all, and what took it out says which parameters absorb it.

What is known of parameters beforehand counts as further samples, one for each parameter: an effect that is as good as a
change of a constant that nobody measured is worth what that change would be a surprise.

Shapes: T trials, N samples, P free parameters of the fit, R = T N + P samples and expectations, E parameters of the
effect.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import torch
from scipy.linalg import eigh

from myowave.data.trials import Array
from myowave.identification.free_parameters import Free, bind_values, bounds, effect_parameters, scales
from myowave.identification.least_squares import FitError, correlations, gain_of, scaled_slope
from myowave.identification.output_error import TOLERANCE, Fit
from myowave.identification.stages import FAILURES
from myowave.physics.effect import Effect
from myowave.physics.model import Model
from myowave.physics.motion import resting_states
from myowave.physics.trajectory import Newton, Sensitive, derivatives_of, solve

REACH = 0.3  # step of the differences by an effect's parameters, in units of a typical strength
POWER = 1.2816  # standard deviations above a threshold that 9 of 10 recordings reach
ABSORBED = 0.01  # visible share below which an effect is as good as a change of the parameters fitted already
LARGE_PART = 0.1  # parameters that imitate at least this part of what the largest imitator does are named


@dataclass(frozen=True)
class ScoreTest:
    """What one effect could do for a fit."""

    effect: str  # its name
    free: tuple[Free, ...]  # its parameters
    start: Fit  # the fit of the model with the effect at 0, to descend from
    # derivatives by its parameters, in units of their scale, without what other parameters and starts imitate, (R, E)
    signal: Array
    information: Array  # signal^T signal (E, E) [rad^2]
    estimate: Array  # best values within the bounds, (E,), in units of the scale
    drop: float  # fall of the sum of squares that they promise [rad^2]
    visible: float  # share of the derivative that is left, of the combination of parameters that keeps the most [-]
    absorbed_by: tuple[str, ...]  # free parameters that imitate the rest, the largest first
    failure: str = ""  # why there is no score; empty where there is one

    @property
    def absorbed(self) -> bool:
        return self.visible < ABSORBED and not self.failure

    def detectable(self, variance: float, statistic: float) -> float:
        """Smallest value of the first parameter that 9 of 10 recordings would show [its unit], given the variance of an
        independent sample of the residual [rad^2] and the chi-square that counts as found."""
        if self.failure:
            return np.inf
        information = max(float(self.information[0, 0]), 1e-300)
        return self.free[0].scale * (np.sqrt(statistic) + POWER) * np.sqrt(variance / information)


def score_effects(fit: Fit, effects: Iterable[Effect]) -> dict[str, ScoreTest]:
    """Score every effect that the fitted model does not have; one that cannot be scored says why in its `failure`."""
    present = {e.name for e in fit.model.effects}
    return {e.name: _score_or_reason(fit, e) for e in effects if e.name not in present}


def _score_or_reason(fit: Fit, effect: Effect) -> ScoreTest:
    """The score of an effect; of one that cannot be scored, which promises nothing, the reason."""
    try:
        return score_effect(fit, effect)
    except FAILURES as error:
        free = effect_parameters(fit.model.with_effects([effect]), effect)
        rows = (len(fit.normal.left),), (len(free),), ()
        signal, information, estimate = (np.zeros((*some, len(free))) for some in rows)
        return ScoreTest(effect.name, free, fit, signal, information, estimate, 0.0, 0.0, (), str(error))


def score_effect(fit: Fit, effect: Effect) -> ScoreTest:
    """Score one effect; see the module. A FitError if the model with the effect has no finite derivatives along the
    motion of the fit."""
    model = fit.model.with_effects([effect])
    free = effect_parameters(model, effect)
    start = _start(fit, model, free)
    count, normal = len(fit.free), fit.normal
    raw = start.normal.slope[..., count:]
    signal, imitation = normal.beyond(raw)
    information = signal.T @ signal
    low, high = (bound / scales(free) for bound in bounds(free))
    estimate, drop = gain_of(information, signal.T @ normal.left, low, high)
    visible, direction = _visible(information, np.einsum("tne,tnf->ef", raw, raw))
    size = np.abs(imitation @ direction) * np.sqrt(np.einsum("tnp,tnp->p", normal.slope, normal.slope))
    order = np.argsort(-size)
    absorbers = tuple(fit.free[i].name for i in order if size[i] > LARGE_PART * size[order[0]])
    return ScoreTest(effect.name, free, start, signal, information, estimate, drop, visible, absorbers)


def confusion(scores: Mapping[str, ScoreTest], one: str, other: str) -> float:
    """How much of what one effect does another can imitate: 1 for all of it [-]. Both as `score_effects` gave them."""
    a, b = scores[one], scores[other]
    # The values that the data call for, or the most visible combination where they call for none.
    signal = a.signal @ (a.estimate if np.any(a.estimate) else np.linalg.eigh(a.information)[1][:, -1])
    _, imitated = gain_of(b.information, b.signal.T @ signal)
    return float(np.sqrt(np.clip(imitated / max((signal**2).sum(), 1e-300), 0.0, 1.0)))


def _start(fit: Fit, model: Model, free: tuple[Free, ...]) -> Fit:
    """The fit of a model with an effect more, that is still 0: the same motion, with derivatives by its parameters."""
    record, old = fit.record, fit.sensitive
    simulation = record.simulation(model, bind_values(fit.free, fit.values))
    wrt = {p.name: p.scale for p in free}
    if model.stateful == fit.model.stateful:
        # Where the effect is one-sided the difference must reach to the side that is allowed.
        reach = REACH * (1 if all(p.high > 0 for p in free) else -1)
        added, tangent = derivatives_of(simulation, fit.linear, wrt, reach)
        motion, linear, of_others = old.motion, old.linear, old.tangent
    else:
        begin = torch.from_numpy(fit.starts)
        guess = resting_states(simulation, old.motion.q, old.motion.qdot)
        newton = Newton(tolerance=TOLERANCE)
        solved = solve(simulation, begin[:, 0], begin[:, 1], guess=guess, wrt=wrt, newton=newton)
        added, tangent = solved.by_parameter, solved.tangent[..., : len(free)]
        motion, linear = solved.motion, solved.linear
        # How other parameters move the new states is not known here; a fit's next step finds it.
        of_others = torch.nn.functional.pad(old.tangent, (0, 0, 0, model.state_size - fit.model.state_size))
    count = len(fit.free)
    if not np.isfinite(added.numpy()[:, record.valid]).all():
        raise FitError(f"{model.name}: the derivatives along the fitted motion are not finite.")
    sensitive = Sensitive(
        motion=motion,
        by_parameter=torch.cat([old.by_parameter, added]),
        by_start=old.by_start,
        tangent=torch.cat([of_others[..., :count], tangent, of_others[..., count:]], -1),
        gap=old.gap,
        linear=linear,
    )
    everything = (*fit.free, *free)
    values = np.concatenate([fit.values, np.zeros(len(free))])
    # The motion is that of the fit, so its normal equations hold, with a few columns more.
    normal = fit.normal.extended(scaled_slope(added, scales(free), record.valid))
    return Fit(simulation, record, everything, values, fit.starts, normal, sensitive)


def _visible(left: Array, whole: Array) -> tuple[float, Array]:
    """Largest share of a combination's derivative that is left, and the combination."""
    size = np.sqrt(np.diag(whole)).clip(1e-150)
    shares, directions = eigh(left / np.outer(size, size), correlations(whole) + 1e-8 * np.eye(len(whole)))
    return float(np.sqrt(max(shares[-1], 0.0))), directions[:, -1] / size
