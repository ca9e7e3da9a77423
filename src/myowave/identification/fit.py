"""Fit a model to trials by output error: the parameters whose simulated motion is nearest to the measured one.

The motion and its derivatives come from `physics.trajectory.solve`, all samples at once. That allows two stages:
1. *Lifted* Gauss-Newton steps, that start from the measured motion and close the gaps to a simulated one and move the
   parameters together. Linearised near the data rather than near a wrong simulation, they reach the right basin
   from far away. Several starts run as one batch, and after each step the better half goes on.
2. Levenberg-Marquardt on simulated motions, with bounds, until a step would gain nothing that noise allows to see.
The angle and velocity at the start of each trial are estimated with the parameters; nobody measures them (`normal`).

Shapes: B starts of the search, T trials, N samples, P free parameters, S numbers of a trial's start (1 or 2).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from myowave.identification.normal import Array, Free, Normal, bounded_step, normal_equations
from myowave.identification.record import Record
from myowave.physics.model import Model
from myowave.physics.motion import resting_states
from myowave.physics.simulation import Simulation
from myowave.physics.trajectory import Linear, Newton, Sensitive, solve

TOLERANCE = 1e-5  # of the simulated state [rad, rad/s]
GAIN = 1e-3  # stop where the next step would lower the sum of squares by less than this many residual variances
LIFTED_STEPS, STEPS = 4, 30  # the first suffice for sixteen starts to come down to two
WATCHDOG, WATCHDOG_STEPS = 100.0, 3  # a step that fails is followed further if the sum of squares grew by less
DAMPING, DAMPING_UP, DAMPING_DOWN, DAMPING_MOST = 1e-4, 10.0, 0.1, 1e8


@dataclass(frozen=True)
class Fit:
    """A fitted model.

    Args:
        values: the free parameters, (P,); `free` says which.
        starts: angle and velocity at the start of each trial, (T, 2).
        angle: simulated [rad], (T, N).
        normal: residuals and derivatives at the solution.
        sensitive: the solved motion.
        record: what was fitted.
        converged: whether no step could gain anything any more.
    """

    model: Model
    free: tuple[Free, ...]
    values: Array
    starts: Array
    normal: Normal
    sensitive: Sensitive
    record: Record
    converged: bool

    @property
    def angle(self) -> Array:
        return self.sensitive.motion.angle.numpy()

    @property
    def linear(self) -> Linear:
        return self.sensitive.linear

    @property
    def rss(self) -> float:
        return float(self.normal.rss)

    @property
    def degrees_of_freedom(self) -> int:
        return self.record.samples - len(self.free) - self.normal.by_start.shape[-1] * len(self.record.names)

    @property
    def variance(self) -> float:
        """Variance of the residual [rad^2]."""
        return self.rss / self.degrees_of_freedom

    @property
    def parameters(self) -> dict[str, float]:
        return {p.name: float(v) for p, v in zip(self.free, self.values, strict=True)}

    @property
    def params(self) -> dict[str, Tensor]:
        """Every parameter that is not at its default, as tensors for the physics."""
        return bind_values(self.free, self.values, self.record)

    def at_bound(self, name: str) -> bool:
        """Whether a parameter ended on a bound that is neither 0, the absence of an effect, nor its usual strength, as
        the share of other curves, which is 1 where they replace the base model's."""
        p, value = next((p, v) for p, v in zip(self.free, self.values, strict=True) if p.name == name)
        return any(
            abs(value - bound) < 1e-9 * p.scale and abs(bound) not in (0.0, p.scale) for bound in (p.low, p.high)
        )

    def covariance(self) -> Array:
        """Covariance of the free parameters (P, P), with the variance of the residual times its correlation time."""
        scale = np.array([p.scale for p in self.free])
        inverse = np.linalg.pinv(self.normal.matrix, hermitian=True)
        return inverse * np.outer(scale, scale) * self.variance * correlation_time(self.normal.residual, self.record)

    def standard_errors(self) -> dict[str, float]:
        return {p.name: float(e) for p, e in zip(self.free, np.sqrt(np.diag(self.covariance())), strict=True)}

    def rmse(self) -> float:
        """Root mean square of the residual [rad]."""
        return float(np.sqrt(self.rss / self.record.samples))

    def rmse_by_trial(self) -> Array:
        """(T,) [rad]."""
        return np.sqrt((self.normal.residual**2).sum(-1) / self.record.valid.sum(-1))


def correlation_time(residual: Array, record: Record) -> float:
    """How many samples of a residual (T, N) are worth one independent sample; 1 for white noise.

    1 + 2 (sum of the autocorrelation up to its first value within the scatter of white noise).
    """
    n = record.samples
    spectrum = np.fft.rfft(residual, 2 * residual.shape[-1], axis=-1)
    lags = np.fft.irfft(np.abs(spectrum) ** 2, axis=-1)[..., : residual.shape[-1]].sum(0)
    correlation = lags / max(lags[0], 1e-300)
    inside = np.flatnonzero(correlation < 2 / np.sqrt(n))
    last = inside[0] if len(inside) else len(correlation)
    return float(1 + 2 * correlation[1:last].sum())


def bind_values(free: Sequence[Free], values: Array, record: Record) -> dict[str, Tensor]:
    """Known constants and free parameters as tensors; `values` (..., P) give parameters (..., 1)."""
    given = {p.name: torch.from_numpy(np.ascontiguousarray(values[..., i, None])) for i, p in enumerate(free)}
    return {**record.known, **given}


def fit_model(
    model: Model,
    record: Record,
    free: Sequence[Free],
    *,
    starts: int = 1,
    seed: int = 0,
) -> Fit:
    """Fit a model from scratch.

    Args:
        record: all trials in it are fitted.
        free: what to estimate.
        starts: searches, the first from `Free.start`, the others up to `Free.spread` away.

    Raises:
        ValueError: if the model is not able to move from any of the starts.
    """
    free = tuple(free)
    random = np.random.default_rng(seed)
    nominal, spread = (np.array([getattr(p, n) for p in free]) for n in ("start", "spread"))
    shift = random.uniform(-1, 1, (starts, len(free))) * spread
    shift[0] = 0.0
    values = _clip(free, nominal * (1 + shift))
    guess = with_states(model, record, free, values, record.first_guess().expand(starts, -1, -1, -1))
    begin = guess[..., 0, :2].numpy().copy()
    if record.at_rest:
        begin[..., 1] = 0.0
    for _ in range(LIFTED_STEPS):
        result = _solve(model, record, free, values, begin, guess, iterations=1)
        normal = normal_equations(result, record, free)
        step = bounded_step(normal, free, values, DAMPING)
        values, begin, guess = _move(free, values, begin, result, normal, step)
        keep = max(2, -(-len(values) // 2))
        better = np.argsort(normal.rss, kind="stable")[:keep]  # those that diverged come last
        values, begin, guess = values[better], begin[better], guess[torch.from_numpy(better)]
    attempts = (_attempt(model, record, free, *search) for search in zip(values, begin, guess, strict=True))
    best = next((fit for fit in attempts if fit is not None), None)
    if best is None:
        raise ValueError(
            f"model {model.name}: its motion diverges from every start of the fit. Check the units of the recording "
            "and the constants of physics.muscles."
        )
    return polish(best)


def refit(fit: Fit, model: Model, free: Sequence[Free]) -> Fit:
    """Fit a related model from where another fit ended.

    Args:
        fit: parameters that both have start from here; others from `Free.start`.
        model: with effects added or taken away.
        free: all that is estimated now.
    """
    record, free = fit.record, tuple(free)
    known = fit.parameters
    values = _clip(free, np.array([known.get(p.name, p.start) for p in free]))
    state = fit.sensitive.motion.state
    guess = state if model.stateful == fit.model.stateful else with_states(model, record, free, values, state)
    begun = _attempt(model, record, free, values, fit.starts, guess)
    return fit_model(model, record, free) if begun is None else polish(begun)


def with_states(model: Model, record: Record, free: Sequence[Free], values: Array, state: Tensor) -> Tensor:
    """A guess of a model's state from a known motion: the states of its effects are at rest at every sample.

    Args:
        state: q and qdot, then states of another model, which are left out, (..., T, N, K).
    """
    simulation = Simulation(model, bind_values(free, values, record), record.emg, record.dt)
    return resting_states(simulation, state[..., 0], state[..., 1])


def _solve(
    model: Model, record: Record, free: Sequence[Free], values: Array, begin: Array, guess: Tensor, iterations: int = 25
) -> Sensitive:
    return solve(
        Simulation(model, bind_values(free, values, record), record.emg, record.dt),
        torch.from_numpy(begin[..., 0].copy()),
        torch.from_numpy(begin[..., 1].copy()),
        guess=guess,
        wrt={p.name: p.scale for p in free},
        newton=Newton(iterations, TOLERANCE, rescue=False),
    )


def _move(
    free: Sequence[Free], values: Array, begin: Array, result: Sensitive, normal: Normal, step: Array
) -> tuple[Array, Array, Tensor]:
    """Values, starts and a guess of the state after a step."""
    scale = np.array([p.scale for p in free])
    shift = _padded(normal.starts_after(step))
    both = np.concatenate([np.broadcast_to((step * scale)[..., None, :], (*shift.shape[:-1], len(scale))), shift], -1)
    change = torch.einsum("...tnkp,...tp->...tnk", result.tangent, torch.from_numpy(both))
    return _stepped(free, values, step), begin + shift, result.motion.state + change


def _stepped(free: Sequence[Free], values: Array, step: Array) -> Array:
    """Values after a step in units of the scales: positive constants move by a factor, as products are known best."""
    scale, low = (np.array([getattr(p, n) for p in free]) for n in ("scale", "low"))
    safe = np.where(low > 0, values, 1.0)
    factor = np.exp((step * scale / safe).clip(-1.0, 1.0))
    return _clip(free, np.where(low > 0, values * factor, values + step * scale))


def _padded(shift: Array) -> Array:
    """Changes of angle and velocity at the start (..., 2), where the velocity is known too."""
    return np.concatenate([shift, np.zeros_like(shift)], -1)[..., :2]


def _clip(free: Sequence[Free], values: Array) -> Array:
    return values.clip([p.low for p in free], [p.high for p in free])


def _attempt(
    model: Model, record: Record, free: tuple[Free, ...], values: Array, begin: Array, guess: Tensor
) -> Fit | None:
    """The fit at given values, or None where no motion was found near the guess."""
    result = _solve(model, record, free, values, begin, guess)
    if not result.gap < TOLERANCE:
        return None
    return Fit(model, free, values, begin, normal_equations(result, record, free), result, record, converged=False)


def polish(fit: Fit) -> Fit:
    """The fit at the end of its descent."""
    *_, last = descend(fit)
    return last


def descend(fit: Fit) -> Iterator[Fit]:
    """Levenberg-Marquardt: the fit as it is, then after each step, each no worse than the one before.

    A full step along a curved valley may land on its slope; the next steps from there lead back to the floor, further
    on. So a step that fails gets these before it is given up (Chamberlain et al. 1982, the "watchdog" technique).
    """
    damping = DAMPING
    yield fit
    for _ in range(STEPS):
        step = bounded_step(fit.normal, fit.free, fit.values, damping)
        if fit.converged or gain(fit, step) < GAIN * fit.variance:
            yield replace(fit, converged=True)
            return
        tried = _follow(fit, _take(fit, step), damping)
        if tried is not None and tried.rss < fit.rss:
            fit, damping = tried, max(damping * DAMPING_DOWN, 1e-12)
        elif damping > DAMPING_MOST:
            return
        else:
            damping = max(damping, DAMPING) * DAMPING_UP
        yield fit


def _follow(fit: Fit, tried: Fit | None, damping: float) -> Fit | None:
    """What a failed step leads to in a few more, as long as each lowers the sum of squares."""
    limit = WATCHDOG * fit.rss
    for _ in range(WATCHDOG_STEPS):
        if tried is None or tried.rss < fit.rss or tried.rss > limit:
            break
        limit = tried.rss
        tried = _take(tried, bounded_step(tried.normal, tried.free, tried.values, damping))
    return tried


def _take(fit: Fit, step: Array) -> Fit | None:
    """The fit after a step, or None where no motion was found there."""
    values, begin, guess = _move(fit.free, fit.values, fit.starts, fit.sensitive, fit.normal, step)
    return _attempt(fit.model, fit.record, fit.free, values, begin, guess)


def promised(fit: Fit) -> float:
    """The sum of squares that the next full step promises [rad^2]."""
    return fit.rss - gain(fit, bounded_step(fit.normal, fit.free, fit.values, DAMPING))


def gain(fit: Fit, step: Array) -> float:
    """How much a step would lower the sum of squares, to first order."""
    normal = fit.normal
    left = normal.without_starts((normal.residual - normal.slope @ step)[..., None])
    return float(normal.rss - (left**2).sum())


def free_parameters(model: Model, identify: Mapping[str, object], known: Mapping[str, object]) -> tuple[Free, ...]:
    """What to estimate: the constants that a dataset wants identified and all parameters of the model's effects.

    Args:
        identify: {constant: settings with start_spread, low, high}.
        known: names that are known and so not estimated.
    """
    free = []
    for name, choice in identify.items():
        if name in model.effect_parameters or name in known:
            continue
        value = model.defaults[name]
        # ASSUME: a constant is within a factor of 5 of the model's value where no bounds are given.
        low = value / 5 if choice.low is None else choice.low
        high = value * 5 if choice.high is None else choice.high
        free.append(Free(name, min(max(value, low), high), low, high, abs(value), choice.start_spread))
    for name, p in model.effect_parameters.items():
        if name not in known:
            free.append(Free(name, 0.0, p.low, p.high, abs(p.typical)))
    return tuple(free)
