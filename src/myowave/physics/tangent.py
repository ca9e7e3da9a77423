"""Exact derivatives of a step of the integrator by its beginning and by parameters.

Each of many steps has parameters of its own, so one pass backwards gives the derivatives of all of them by all
parameters; differences would cost one evaluation of the model for each parameter.

Where the state is angle and velocity alone, the acceleration is evaluated at all stages of all Runge-Kutta steps at
once, and its derivatives by angle, velocity, activation and every parameter make a linear equation: the derivative of a
Runge-Kutta step is the same step of that. Where effects have states, the step itself is evaluated, and one pass
backwards for each number of the state gives the derivatives of that.

Shapes: ... batch, T trials, N samples, n of the steps, S pieces of a step, 4 stages of a piece, M muscles, K numbers of
the state, P parameters.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from myowave.physics.drive import Drive, breakpoints
from myowave.physics.dynamics import acceleration
from myowave.physics.motion import STAGES, advance, pack, runge_kutta, unpack
from myowave.physics.simulation import Simulation
from myowave.physics.valued import Valued, give_values

MOST_POINTS = 100_000  # evaluated at once
COSTLIER = 3  # evaluations of the muscles for each point where effects have states, about
INSIDE = 1e-3  # of a piece: its ends are kinks, whose derivatives by a delay are those from inside the piece
NUDGE = 1e-6  # relative step of one-sided differences; their error is far below what a fit needs


@dataclass(frozen=True)
class Linear:
    """The map from each sample to the next and its Jacobian, where they were evaluated.

    Args:
        at: the state there, (..., T, N, K).
        after: F(at[n]), (..., T, N - 1, K).
        jacobian: dF/dx, (..., T, N - 1, K, K).
    """

    at: Tensor
    after: Tensor
    jacobian: Tensor


def linearise(simulation: Simulation, state: Tensor, wrt: Mapping[str, float]) -> tuple[Linear, Tensor]:
    """Where each step leads, and its derivatives.

    Args:
        state: at every sample, (..., T, N, K).
        wrt: parameters, with the size of a usual change of each.

    Returns:
        The steps with their Jacobian, and what a change of each parameter adds to the state within each step,
        (..., T, N - 1, K, P).
    """
    simulation.model.check_names(wrt)
    drive, before = simulation.drive, state[..., :-1, :]
    steps, size, pieces = before.shape[-2], state.shape[-1], drive.pieces.shape[-1]
    with_states = bool(simulation.model.stateful)
    evaluated = 4 * pieces * (COSTLIER if with_states else 1)
    length = max(1, MOST_POINTS // (evaluated * max(1, before[..., 0, 0].numel())))
    linear = _by_steps if with_states else _by_stages
    parts = []
    for first in range(0, steps, length):
        chunk = slice(first, min(first + length, steps))
        parts.append(linear(simulation, before[..., chunk, :], drive.part(chunk), chunk, wrt))
    after, derivatives = (torch.cat(part, axis) for part, axis in zip(zip(*parts, strict=True), (-2, -3), strict=True))
    return Linear(state, after, derivatives[..., :size]), derivatives[..., size:]


def _by_stages(
    simulation: Simulation, state: Tensor, drive: Drive, steps: slice, wrt: Mapping[str, float]
) -> tuple[Tensor, Tensor]:
    """Where steps of a model without states of effects lead, and the derivatives by their beginning and by parameters,
    (..., T, n, 2) and (..., T, n, 2, 2 + P)."""
    points, after = _points(simulation.along_time, state, drive)
    slopes = _slopes(simulation, points, list(wrt))
    changes = _changes_of_drive(simulation, wrt, steps, state.ndim - 2)
    if changes is not None:
        slopes.parameter[changes.columns] += (slopes.activation * changes.activation[..., STAGES, :]).sum(-1)
    return after, _forced(slopes, drive.pieces)


@dataclass(frozen=True)
class Points:
    """Where the stages of all pieces are: q, qdot (..., T, n, S, 4), the activation (..., T, n, S, 4, M), and what
    is known over time, if anything is, (..., T, n, S, 4, V)."""

    q: Tensor
    qdot: Tensor
    activation: Tensor
    course: Tensor | None


@dataclass(frozen=True)
class Slopes:
    """Derivatives of the acceleration at points (..., T, n, S, 4): by q and qdot of this shape, by the activation (M
    more, behind), and by parameters (P more, in front)."""

    q: Tensor
    qdot: Tensor
    activation: Tensor
    parameter: Tensor


def _points(valued: Valued, state: Tensor, drive: Drive) -> tuple[Points, Tensor]:
    """The stages of the steps from states (..., T, n, 2), and where these lead."""
    q, qdot = state.unbind(-1)
    seen: list[tuple[Tensor, Tensor]] = []
    activation, timed = drive.activation.unbind(-2), drive.timed(valued)
    places = [2 * piece + point for piece in range(drive.pieces.shape[-1]) for point in STAGES]
    for piece, h in enumerate(drive.pieces.unbind(-1)):

        def accelerate(stage: int, q: Tensor, qdot: Tensor, first: int = 4 * piece) -> Tensor:
            seen.append((q, qdot))
            place = places[first + stage]
            return acceleration(timed[place], q, qdot, activation[place], {})

        q, qdot = runge_kutta(accelerate, q, qdot, h)
    after = torch.stack(torch.broadcast_tensors(q, qdot), -1)
    q, qdot = (torch.stack(torch.broadcast_tensors(*x), -1).unflatten(-1, (-1, 4)) for x in zip(*seen, strict=True))
    course = None if drive.course is None else drive.course[..., places, :].unflatten(-2, (-1, 4))
    return Points(q, qdot, drive.activation[..., places, :].unflatten(-2, (-1, 4)), course), after


def _slopes(simulation: Simulation, points: Points, names: Sequence[str]) -> Slopes:
    """Derivatives at points by the values of parameters that stand in `names`."""
    with torch.enable_grad():
        q, qdot = (x.detach().requires_grad_() for x in (points.q, points.qdot))
        activation = _leaf(points.activation, q.shape, muscles=1)
        valued, leaves = _valued_at(simulation, names, q.shape, axes=3)
        pull = acceleration(valued.timed(points.course), q, qdot, activation.movedim(0, -1), {})
    slopes = _derivatives(pull, [q, qdot, activation, *leaves])
    by_parameter = torch.stack(slopes[3:]) if names else points.q.new_zeros(0, *q.shape)
    return Slopes(slopes[0], slopes[1], slopes[2].movedim(0, -1), by_parameter)


def _by_steps(
    simulation: Simulation, state: Tensor, drive: Drive, steps: slice, wrt: Mapping[str, float]
) -> tuple[Tensor, Tensor]:
    """Where steps lead, and the derivatives by their beginning and by parameters, (..., T, n, K) and
    (..., T, n, K, K + P)."""
    model, size, pieces = simulation.model, state.shape[-1], drive.pieces.shape[-1]
    shape = state.shape[:-1]
    places = [2 * piece + point for piece in range(pieces) for point in range(3)]  # each piece with ends of its own
    with torch.enable_grad():
        begin = state.detach().movedim(-1, 0).contiguous().requires_grad_()
        u, a = (_leaf(x[..., places, :], shape, muscles=2) for x in (drive.excitation, drive.activation))
        valued, leaves = _valued_at(simulation, list(wrt), shape, axes=1)
        timed = drive.timed(valued)
        q, qdot, states = unpack(model, begin.movedim(0, -1))
        for piece, h in enumerate(drive.pieces.unbind(-1)):
            at = range(3 * piece, 3 * piece + 3)
            u_at, a_at = (tuple(x[:, i].movedim(0, -1) for i in at) for x in (u, a))
            q, qdot, states = advance(timed[2 * piece : 2 * piece + 3], states, q, qdot, u_at, a_at, h)
        after = pack(model, q, qdot, states)
        numbers = [_derivatives(after[..., k], [begin, u, a, *leaves], kept=k + 1 < size) for k in range(size)]
    by_state, by_u, by_a, *by_parameter = (torch.stack(slopes) for slopes in zip(*numbers, strict=True))
    derivatives = torch.stack([*by_state.unbind(1), *by_parameter], -1).movedim(0, -2)
    changes = _changes_of_drive(simulation, wrt, steps, state.ndim - 2)
    if changes is not None:
        for slope, change in ((by_u, changes.excitation), (by_a, changes.activation)):
            slope = slope.movedim((1, 2), (-1, -2)).unflatten(-2, (-1, 3))  # (K, ..., T, n, S, 3, M)
            added = (slope * change.unsqueeze(1)).sum((-1, -2, -3))
            derivatives[..., [size + column for column in changes.columns]] += added.movedim((0, 1), (-1, -2))
    return after.detach(), derivatives


def _leaf(values: Tensor, shape: Sequence[int], muscles: int) -> Tensor:
    """Values (..., M) as what derivatives are taken by; the muscles, and of two axes the points before them, in front,
    as `dynamics.muscle_quantities` has them."""
    axes = tuple(range(-1, -1 - muscles, -1))
    values = values.expand(*shape, *values.shape[values.ndim - muscles :]).movedim(axes, tuple(range(muscles)))
    return values.detach().contiguous().requires_grad_()


def _valued_at(
    simulation: Simulation, names: Sequence[str], shape: torch.Size, axes: int
) -> tuple[Valued, list[Tensor]]:
    """The model with values for points of a shape, and those in `names`, one for each point.

    Args:
        axes: of the points, behind the batch (..., T).
    """
    values = {n: simulation.params.get(n, simulation.model.defaults[n]) for n in (*simulation.params, *names)}
    params = {name: _at_points(value, simulation.emg, axes) for name, value in values.items()}
    leaves = [params[name].expand(shape).contiguous().requires_grad_() for name in names]
    return give_values(simulation.model, {**params, **dict(zip(names, leaves, strict=True))}, simulation.emg), leaves


def _derivatives(of: Tensor, by: Sequence[Tensor], *, kept: bool = False) -> list[Tensor]:
    """Derivatives of what stands at each point by what stands there; 0 by what nothing depends on.

    Args:
        kept: whether more derivatives of the same values are to follow.
    """
    found = torch.autograd.grad(of.sum(), by, allow_unused=True, retain_graph=kept)
    return [torch.zeros_like(x) if slope is None else slope for x, slope in zip(by, found, strict=True)]


def _at_points(value: Tensor | float, like: Tensor, axes: int) -> Tensor:
    """A parameter's value (..., T) as one that is broadcastable to points behind it."""
    value = torch.as_tensor(value, dtype=like.dtype, device=like.device)
    return value.reshape(*value.shape, *(1,) * axes) if value.ndim else value


@dataclass(frozen=True)
class Changes:
    """Derivatives by the parameters that change the drive, at the beginning, middle and end of the pieces of steps,
    (D, ..., T, n, S, 3, M) for D of P parameters, whose places are `columns`."""

    columns: list[int]
    excitation: Tensor
    activation: Tensor


def _changes_of_drive(simulation: Simulation, wrt: Mapping[str, float], steps: slice, axes: int) -> Changes | None:
    """How parameters change the drive of the muscles at fixed times; None where none does.

    Args:
        axes: of the batch (..., T).
    """
    driving = {name: size for name, size in wrt.items() if simulation.model.drives(name)}
    if not driving:
        return None
    dt = simulation.dt
    split = breakpoints(simulation.valued, dt, simulation.substeps)  # (..., T, S + 1)
    begin, length = split[..., :-1, None], torch.diff(split, dim=-1)[..., None]
    inside = torch.tensor([INSIDE, 0.5, 1 - INSIDE], dtype=split.dtype, device=split.device)
    within = (begin + length * inside).flatten(-2)  # (..., T, 3 S)
    start = torch.arange(steps.start, steps.stop, dtype=split.dtype, device=split.device)
    position = start[:, None, None] + within[..., None, :, None]
    nudged, nudges = simulation.nudged(driving, NUDGE, axes)
    pairs = zip(simulation.activate(position), nudged.activate(position), strict=True)
    nudges = nudges.reshape(-1, *(1,) * (axes + 3))
    changes = ((moved - still) / nudges for still, moved in pairs)
    columns = [i for i, name in enumerate(wrt) if name in driving]
    return Changes(columns, *(change.unflatten(-2, (-1, 3)) for change in changes))


def _forced(slopes: Slopes, pieces: Tensor) -> Tensor:
    """Derivatives of the state (..., T, n, 2, 2 + P) by q and qdot at the beginning of the pieces (..., T, 1, S) and by
    parameters: a linear equation."""
    by_parameter = torch.nn.functional.pad(slopes.parameter, (0, 0) * slopes.q.ndim + (2, 0))
    q, qdot = torch.zeros_like(by_parameter[..., 0, 0]), torch.zeros_like(by_parameter[..., 0, 0])
    q[0], qdot[1] = 1.0, 1.0
    for piece, h in enumerate(pieces.unbind(-1)):
        by_q, by_qdot, forcing = slopes.q[..., piece, :], slopes.qdot[..., piece, :], by_parameter[..., piece, :]

        def accelerate(
            stage: int, q: Tensor, qdot: Tensor, parts: tuple[Tensor, ...] = (by_q, by_qdot, forcing)
        ) -> Tensor:
            by_q, by_qdot, forcing = (part[..., stage] for part in parts)
            return by_q * q + by_qdot * qdot + forcing

        q, qdot = runge_kutta(accelerate, q, qdot, h)
    return torch.stack([q, qdot], -1).movedim(0, -1)
