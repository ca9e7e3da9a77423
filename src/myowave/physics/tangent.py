"""Exact derivatives of a step of the integrator, for models whose state is angle and velocity alone.

The acceleration is evaluated at all stages of all Runge-Kutta steps at once, and its derivatives by angle, velocity,
activation and every parameter come from one pass backwards, as each point has parameters of its own. The derivative of
a Runge-Kutta step is then the same step of the linear equation that these make. That costs a few evaluations of the
model; differences would cost one for each parameter.

Shapes: ... batch, T trials, N samples, S pieces of a step, 4 stages of a piece, M muscles, P parameters.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from myowave.physics.drive import Drive, breakpoints
from myowave.physics.dynamics import acceleration
from myowave.physics.motion import STAGES, runge_kutta
from myowave.physics.simulation import Simulation
from myowave.physics.valued import Valued, give_values

MOST_POINTS = 100_000  # evaluated at once
INSIDE = 1e-3  # of a piece: its ends are kinks, whose derivatives by a delay are those from inside the piece
NUDGE = 1e-6  # relative step of one-sided differences; their error is far below what a fit needs


def linear_forcing(simulation: Simulation, state: Tensor, wrt: Mapping[str, float]) -> Tensor:
    """What a change of each parameter adds to the state within each step, (..., T, N - 1, 2, P).

    Args:
        simulation: of a model without states of effects.
        state: at the beginning of each step, (..., T, N - 1, 2).
        wrt: parameters, with the size of a usual change of each.
    """
    simulation.model.check_names(wrt)
    assert simulation.model.state_size == 2, simulation.model.name
    driving = {name: size for name, size in wrt.items() if simulation.model.drives(name)}
    drive = simulation.drive
    steps, pieces = state.shape[-2], drive.pieces.shape[-1]
    length = max(1, MOST_POINTS // (4 * pieces * max(1, state[..., 0, 0].numel())))
    columns = [i for i, name in enumerate(wrt) if name in driving]
    parts = []
    for first in range(0, steps, length):
        chunk = slice(first, min(first + length, steps))
        points = _points(simulation.along_time, state[..., chunk, :], drive.part(chunk))
        slopes = _slopes(simulation, points, list(wrt))
        if driving:
            changes = _changes_of_activation(simulation, driving, chunk, state.ndim - 2)[..., STAGES, :]
            slopes.parameter[columns] += (slopes.activation * changes).sum(-1)
        parts.append(_forced(slopes, drive.pieces))
    return torch.cat(parts, -3)


@dataclass(frozen=True)
class Points:
    """Where the stages of all pieces are: q, qdot and the sway of the upper arm, if there is one, (..., T, n, S, 4),
    and the activation (..., T, n, S, 4, M)."""

    q: Tensor
    qdot: Tensor
    activation: Tensor
    sway: Tensor | None


@dataclass(frozen=True)
class Slopes:
    """Derivatives of the acceleration at points (..., T, n, S, 4): by q and qdot of this shape, by the activation (M
    more, behind), and by parameters (P more, in front)."""

    q: Tensor
    qdot: Tensor
    activation: Tensor
    parameter: Tensor


def _points(valued: Valued, state: Tensor, drive: Drive) -> Points:
    """The stages of the steps from states (..., T, n, 2)."""
    q, qdot = state.unbind(-1)
    seen: list[tuple[Tensor, Tensor]] = []
    activation, leaning = drive.activation.unbind(-2), drive.leaning(valued)
    places = [2 * piece + point for piece in range(drive.pieces.shape[-1]) for point in STAGES]
    for piece, h in enumerate(drive.pieces.unbind(-1)):

        def accelerate(stage: int, q: Tensor, qdot: Tensor, first: int = 4 * piece) -> Tensor:
            seen.append((q, qdot))
            place = places[first + stage]
            return acceleration(leaning[place], q, qdot, activation[place], {})

        q, qdot = runge_kutta(accelerate, q, qdot, h)
    q, qdot = (torch.stack(torch.broadcast_tensors(*x), -1).unflatten(-1, (-1, 4)) for x in zip(*seen, strict=True))
    sway = None if drive.sway is None else drive.sway[..., places].unflatten(-1, (-1, 4))
    return Points(q, qdot, drive.activation[..., places, :].unflatten(-2, (-1, 4)), sway)


def _slopes(simulation: Simulation, points: Points, names: Sequence[str]) -> Slopes:
    """Derivatives at points by the values of parameters that stand in `names`."""
    shape, muscles = points.q.shape, points.activation.shape[-1]
    values = {n: simulation.params.get(n, simulation.model.defaults[n]) for n in (*simulation.params, *names)}
    params = {name: _at_points(value, points.q) for name, value in values.items()}
    with torch.enable_grad():
        q, qdot = (x.detach().requires_grad_() for x in (points.q, points.qdot))
        # One muscle after the other in memory, see `dynamics.muscle_quantities`.
        activation = points.activation.expand(*shape, muscles).movedim(-1, 0).contiguous().requires_grad_()
        leaves = [params[name].expand(shape).contiguous().requires_grad_() for name in names]
        valued = give_values(simulation.model, {**params, **dict(zip(names, leaves, strict=True))}, points.q)
        pull = acceleration(valued.leaning(points.sway), q, qdot, activation.movedim(0, -1), {})
        found = torch.autograd.grad(pull.sum(), [q, qdot, activation, *leaves], allow_unused=True)
    # A parameter that nothing depends on here has no derivative: None.
    slopes = [torch.zeros_like(points.q) if slope is None else slope for slope in found]
    by_parameter = torch.stack(slopes[3:]) if names else points.q.new_zeros(0, *shape)
    return Slopes(slopes[0], slopes[1], slopes[2].movedim(0, -1), by_parameter)


def _at_points(value: Tensor | float, like: Tensor) -> Tensor:
    """A parameter's value (..., T) as one that is broadcastable to points (..., T, n, S, 4)."""
    value = torch.as_tensor(value, dtype=like.dtype, device=like.device)
    return value.reshape(*value.shape, *(1,) * 3) if value.ndim else value


def _changes_of_activation(simulation: Simulation, driving: Mapping[str, float], steps: slice, axes: int) -> Tensor:
    """Derivatives of the activation in n steps by parameters that change it, at fixed times, (P, ..., T, n, S, 3, M).

    Args:
        axes: of the batch (..., T).
    """
    dt = simulation.dt
    split = breakpoints(simulation.valued, dt, simulation.substeps)  # (..., T, S + 1)
    begin, length = split[..., :-1, None], torch.diff(split, dim=-1)[..., None]
    inside = torch.tensor([INSIDE, 0.5, 1 - INSIDE], dtype=split.dtype, device=split.device)
    within = (begin + length * inside).flatten(-2)  # (..., T, 3 S)
    start = torch.arange(steps.start, steps.stop, dtype=split.dtype, device=split.device)
    position = start[:, None, None] + within[..., None, :, None]
    nudged, nudges = simulation.nudged(driving, NUDGE, axes)
    (_, still), (_, moved) = simulation.activate(position), nudged.activate(position)
    change = (moved - still) / nudges.reshape(-1, *(1,) * (moved.ndim - 1))
    return change.unflatten(-2, (-1, 3))


def _forced(slopes: Slopes, pieces: Tensor) -> Tensor:
    """The state (..., T, n, 2, P) that a linear equation, which starts from 0, has after its pieces (..., T, 1, S)."""
    q = qdot = torch.zeros_like(slopes.parameter[..., 0, 0])
    for piece, h in enumerate(pieces.unbind(-1)):
        by_q, by_qdot, forcing = slopes.q[..., piece, :], slopes.qdot[..., piece, :], slopes.parameter[..., piece, :]

        def accelerate(
            stage: int, q: Tensor, qdot: Tensor, parts: tuple[Tensor, ...] = (by_q, by_qdot, forcing)
        ) -> Tensor:
            by_q, by_qdot, forcing = (part[..., stage] for part in parts)
            return by_q * q + by_qdot * qdot + forcing

        q, qdot = runge_kutta(accelerate, q, qdot, h)
    return torch.stack([q, qdot], -1).movedim(0, -1)
