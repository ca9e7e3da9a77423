"""What is estimated: the list of free parameters, their bounds, where searches start, and how a step moves them.

Shapes: S seeds, T trials, P free parameters, ... leading batch.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from myowave.data.trials import Array
from myowave.physics.constants import constant_of
from myowave.physics.effect import Effect
from myowave.physics.model import Model
from myowave.settings import Identify, Scatter

WITHIN_FACTOR = 5  # of its usual value, where a constant has no bounds
LARGEST_FACTOR = np.e  # by which one step changes a positive constant
FARTHEST = 12.0  # standard deviations that a constant may be from where it is expected
LEAST_SHARE = 0.05  # of the way from its physical bound that a constant keeps at least


@dataclass(frozen=True)
class Free:
    """A parameter to estimate: where it starts, its bounds, and a usual change of it (the scale of steps)."""

    name: str
    start: float
    low: float
    high: float
    scale: float
    spread: float = 0.0  # further starts are up to this fraction away
    # standard deviation of what is known of it beforehand, about `start`; infinite where nothing is
    deviation: float = np.inf

    @property
    def assumed(self) -> bool:
        """Whether it is free only because nobody measured it: something is known of it before any trial."""
        return bool(np.isfinite(self.deviation))


def free_parameters(
    model: Model,
    identify: Mapping[str, Identify],
    known: Collection[str],
    scatter: Mapping[str, Scatter] | None = None,
) -> tuple[Free, ...]:
    """What to estimate: the constants that a dataset wants identified, those that nobody measured, and all parameters
    of the model's effects.

    Args:
        identify: constants by name, none of them 0 in the model, with where their searches start and their bounds.
        known: names that are known and so not estimated.
        scatter: what is known of constants that nobody measured, by constant (`slack`, of muscles without a group) or
            by parameter (`slack_Bi`).
    """
    wanted = {name: choice for name, choice in identify.items() if name not in known}
    constants = [_constant(name, model.defaults[name], choice) for name, choice in wanted.items()]
    # ASSUME: muscles of a group differ from the model as their group does, by the group's factors.
    grouped = {f"{c}_{muscle.name}" for muscle in model.muscles if muscle.group for c in muscle.nominal}
    scatter, assumed = scatter or {}, []
    for name, value in model.defaults.items():
        if name in model.effect_parameters:
            continue
        deviation = 0.0 if name in grouped and name not in scatter else deviation_of(name, value, scatter)
        if deviation and name not in known and name not in identify:
            assumed.append(_assumed(name, value, deviation))
    return (*constants, *assumed, *(p for effect in model.effects for p in effect_parameters(model, effect, known)))


def deviation_of(name: str, value: float, scatter: Mapping[str, Scatter]) -> float:
    """Standard deviation of a constant that nobody measured about the model's value, SI units; 0 where `scatter`, see
    `free_parameters`, has neither its name nor that of its kind."""
    of = scatter.get(name, scatter.get(name.partition("_")[0]))
    return of.absolute + of.relative * abs(value) if of else 0.0


def effect_parameters(model: Model, effect: Effect, known: Collection[str] = ()) -> tuple[Free, ...]:
    """The parameters of one of a model's effects, from 0, within the bounds that the effect declares."""
    return tuple(
        Free(name, 0.0, p.low, p.high, abs(p.typical))
        for name, p in model.parameters_of(effect).items()
        if name not in known
    )


def _assumed(name: str, value: float, deviation: float) -> Free:
    """A constant that nobody measured."""
    allowed = constant_of(name).bounds
    # ASSUME: no constant is farther than this from where it is expected; what is has another cause.
    low, high = value - FARTHEST * deviation, value + FARTHEST * deviation
    least = max(allowed.get(key, -np.inf) for key in ("gt", "ge"))
    most = min(allowed.get(key, np.inf) for key in ("lt", "le"))
    if value > least:
        low = max(low, least + LEAST_SHARE * (value - least))
    return Free(name, value, max(low, least), min(high, most), deviation, deviation=deviation)


def _constant(name: str, value: float, choice: Identify) -> Free:
    """A constant to identify."""
    low, high = choice.low, choice.high
    if choice.literature:
        high = float(np.mean(choice.literature))  # where Eq. 41 ends
        low = min(value, high) / WITHIN_FACTOR
    if low is None or high is None:
        # ASSUME: a constant is within a factor of 5 of the model's value where no bounds are given.
        low, high = value / WITHIN_FACTOR, value * WITHIN_FACTOR
    return Free(name, min(max(value, low), high), low, high, abs(value), choice.start_spread)


def start_values(free: Sequence[Free], seeds: Sequence[int]) -> Array:
    """Where the search of each seed starts, (S, P): up to `Free.spread` from the usual value.

    A start depends only on the seed and the parameter's name, not on what else is estimated.
    """
    draws = np.array([[_draw(seed, p.name) for p in free] for seed in seeds]).reshape(len(seeds), len(free))
    start, spread = (np.array([getattr(p, name) for p in free]) for name in ("start", "spread"))
    return within(free, start * (1 + spread * draws))


def _draw(seed: int, name: str) -> float:
    """A number in [-1, 1]."""
    random = torch.Generator().manual_seed(seed * 1_000_003 + int.from_bytes(name.encode()) % 1_000_003)
    return float(2 * torch.rand((), generator=random, dtype=torch.float64) - 1)


def bind_values(free: Sequence[Free], values: Array) -> dict[str, Tensor]:
    """Free parameters for the physics, by name; `values` (..., P) give parameters (..., 1)."""
    return {p.name: torch.from_numpy(np.ascontiguousarray(values[..., i, None])) for i, p in enumerate(free)}


def scales(free: Sequence[Free]) -> Array:
    """A usual change of each parameter, (P,)."""
    return np.array([p.scale for p in free])


def expected(free: Sequence[Free]) -> tuple[Array, Array]:
    """What is known beforehand: values, (P,), and their weight in units of the scales, 0 where nothing is, (P,)."""
    weight = np.array([(p.scale / p.deviation) ** 2 for p in free])
    return np.array([p.start for p in free]), weight


def bounds(free: Sequence[Free]) -> tuple[Array, Array]:
    """Lowest and highest values, (P,) each."""
    return np.array([p.low for p in free]), np.array([p.high for p in free])


def within(free: Sequence[Free], values: Array) -> Array:
    """The nearest values (..., P) within the bounds."""
    return values.clip(*bounds(free))


def moved(free: Sequence[Free], values: Array, step: Array) -> Array:
    """Values (..., P) after a step in units of the scales: positive constants move by a factor, as products are known
    best."""
    low, change = bounds(free)[0], step * scales(free)
    most = np.log(LARGEST_FACTOR)
    factor = np.exp((change / np.where(low > 0, values, 1.0)).clip(-most, most))
    return within(free, np.where(low > 0, values * factor, values + change))
