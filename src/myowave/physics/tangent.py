"""Derivatives of a step of the integrator by its beginning and by parameters, of the first state, and of what is seen.

Those of a step are differences, which cost one evaluation for each number of the state and each parameter, or exact:
each of many steps has parameters of its own, so one pass backwards gives the derivatives of all of them by all.

Where no state of an effect depends on the motion, the acceleration is evaluated at all stages of all Runge-Kutta steps
at once, and its derivatives by angle, velocity, activation and every parameter make a linear equation: the derivative
of a Runge-Kutta step is the same step of that. States of activation act through it, and what moves them are differences
that cost no muscle. Where tendons have states, the step itself is evaluated, and one pass backwards for each number of
the state gives the derivatives of that.

Shapes: ... batch, T trials, N samples, n of the steps, S pieces of a step, 4 stages of a piece, M muscles, K numbers of
the state, P parameters.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from myowave.physics.dynamics import torques
from myowave.physics.motion import (
    STAGES,
    advance,
    advance_activation,
    initial_state,
    observe,
    pack,
    runge_kutta,
    step,
    unpack,
)
from myowave.physics.simulation import Drive, Instant, Simulation
from myowave.physics.valued import Valued, along, give_values

MOST_POINTS = 30_000  # evaluated at once
COSTLIER = 3  # evaluations of the muscles for each point where tendons have states, about
BACKWARDS = 2  # evaluations of a step that a pass backwards costs for each number of the state, about
INSIDE = 1e-3  # of a piece: its ends are kinks, whose derivatives by a delay are those from inside the piece
NUDGE = 1e-6  # relative step of one-sided differences; their error is far below what a fit needs


@dataclass(frozen=True)
class Linear:
    """The map from each sample to the next and its Jacobian, where they were evaluated."""

    at: Tensor  # the state there, (..., T, N, K)
    after: Tensor  # F(at[n]), (..., T, N - 1, K)
    jacobian: Tensor  # dF/dx, (..., T, N - 1, K, K)


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
    with_tendons = bool(simulation.model.places["tendon"])
    if state.shape[-1] + len(wrt) <= BACKWARDS * (state.shape[-1] if with_tendons else 1):
        linear = _by_differences(simulation, state)
        return linear, forcing_of(simulation, linear, wrt)
    drive, before, size = simulation.drive, state[..., :-1, :], state.shape[-1]
    evaluated = 4 * drive.pieces.shape[-1] * (COSTLIER if with_tendons else 1)
    length = max(1, MOST_POINTS // (evaluated * max(1, before[..., 0, 0].numel())))
    backwards = _by_steps if with_tendons else _by_stages
    parts = []
    for first in range(0, before.shape[-2], length):
        steps = slice(first, min(first + length, before.shape[-2]))
        parts.append(backwards(simulation, before[..., steps, :], drive.part(steps), steps, wrt))
    after, derivatives = (torch.cat(part, axis) for part, axis in zip(zip(*parts, strict=True), (-2, -3), strict=True))
    return Linear(state, after, derivatives[..., :size]), derivatives[..., size:]


def _by_differences(simulation: Simulation, state: Tensor) -> Linear:
    """Where steps from a state (..., T, N, K) lead, and the Jacobian, by differences."""
    before = state[..., :-1, :]
    bumps = NUDGE * torch.eye(state.shape[-1], dtype=state.dtype, device=state.device)
    bumps = bumps.reshape(-1, *(1,) * (state.ndim - 1), state.shape[-1])
    copies = step(simulation.along_time, torch.cat([before.unsqueeze(0), before + bumps]), simulation.drive)
    return Linear(state, copies[0], ((copies[1:] - copies[0]) / NUDGE).movedim(0, -1))


def forcing_of(simulation: Simulation, linear: Linear, wrt: Mapping[str, float], reach: float = NUDGE) -> Tensor:
    """What a parameter adds to the state within each step, (..., T, N - 1, K, P), by differences; the model may be
    richer than that of the steps, see `trajectory.derivatives_of` for the arguments."""
    forcing = linear.after.new_zeros(*linear.after.shape, len(wrt))
    for columns, nudged, nudges in _nudged_copies(simulation, wrt, reach, linear.at.ndim - 2):
        moved = step(nudged.along_time, linear.at[..., :-1, :], nudged.drive) - linear.after
        forcing[..., columns] = (moved / nudges.reshape(-1, *(1,) * linear.after.ndim)).movedim(0, -1)
    return forcing


def derivatives_of_start(
    simulation: Simulation, q0: Tensor, qdot0: Tensor, wrt: Mapping[str, float], reach: float = NUDGE
) -> Tensor:
    """d first state / d (parameters, q0, qdot0), (..., T, K, P + 2), by differences; effects start at rest."""
    start = initial_state(simulation, q0, qdot0)
    begin = start.new_zeros(*start.shape, len(wrt) + 2)
    for columns, nudged, nudges in _nudged_copies(simulation, wrt, reach, q0.ndim) if simulation.model.stateful else ():
        shifted = initial_state(nudged, q0, qdot0) - start
        begin[..., columns] = (shifted / nudges.reshape(-1, *(1,) * start.ndim)).movedim(0, -1)
    begin[..., -2] = (initial_state(simulation, q0 + NUDGE, qdot0) - start) / NUDGE
    begin[..., -1] = (initial_state(simulation, q0, qdot0 + NUDGE) - start) / NUDGE
    return begin


def derivatives_observed(
    simulation: Simulation, linear: Linear, wrt: Mapping[str, float], tangent: Tensor, reach: float = NUDGE
) -> Tensor:
    """Derivatives of the observed angle (P [+ 2], ..., T, N) from those of the state, by parameters [and the start]."""
    if not simulation.model.places["observation"]:
        return tangent[..., 0, :].movedim(-1, 0)
    nudged, nudges = simulation.nudged(wrt, reach, linear.at.ndim - 2)
    nudges = torch.cat([nudges, nudges.new_full((tangent.shape[-1] - len(wrt),), NUDGE)])
    nudges = nudges.reshape(-1, *(1,) * (linear.at.ndim - 1))
    moved = linear.at + nudges.unsqueeze(-1) * tangent.movedim(-1, 0)
    valued = simulation.along_time
    parts = ((nudged.along_time, moved[: len(wrt)]), (valued, moved[len(wrt) :]))
    angles = torch.cat([observe(values, at[..., 0], at[..., 1], simulation.dt) for values, at in parts if len(at)])
    return (angles - observe(valued, linear.at[..., 0], linear.at[..., 1], simulation.dt)) / nudges


def _nudged_copies(
    simulation: Simulation, wrt: Mapping[str, float], reach: float, axes: int, groups: Sequence[bool] = (True, False)
) -> Iterator[tuple[list[int], Simulation, Tensor]]:
    """Places of parameters in `wrt` with a copy for each, moved by its nudge; first those that change the drive of the
    muscles, as the others share it; of `groups` (True,) these alone."""
    for driving in groups:
        group = {name: size for name, size in wrt.items() if simulation.model.drives(name) is driving}
        if group:
            yield [i for i, name in enumerate(wrt) if name in group], *simulation.nudged(group, reach, axes)


def _by_stages(
    simulation: Simulation, state: Tensor, drive: Drive, steps: slice, wrt: Mapping[str, float]
) -> tuple[Tensor, Tensor]:
    """Where steps of a model without states of tendons lead, and the derivatives by their beginning and by parameters,
    (..., T, n, K) and (..., T, n, K, K + P)."""
    q, qdot, size = state[..., 0], state[..., 1], state.shape[-1]
    seen: list[tuple[Tensor, Tensor]] = []
    instants = drive.instants(simulation.along_time)
    activation, later = _activated(simulation, state, _early(drive), drive.pieces)
    for piece, h in enumerate(drive.pieces.unbind(-1)):

        def accelerate(stage: int, q: Tensor, qdot: Tensor, piece: int = piece) -> Tensor:
            seen.append((q, qdot))
            point = STAGES[stage]
            valued = instants[2 * piece + point].valued
            return torques(valued, q, qdot, activation[..., 3 * piece + point, :], {}).acceleration

        q, qdot = runge_kutta(accelerate, q, qdot, h)
    after = torch.cat([torch.stack(torch.broadcast_tensors(q, qdot), -1), later], -1)
    stages = [3 * piece + point for piece in range(drive.pieces.shape[-1]) for point in STAGES]

    def at_stages(points: Tensor) -> Tensor:
        return points[..., stages, :].unflatten(-2, (-1, 4))

    course = None if drive.course is None else at_stages(drive.course[..., _ends(drive), :])
    q, qdot = (torch.stack(torch.broadcast_tensors(*x), -1).unflatten(-1, (-1, 4)) for x in zip(*seen, strict=True))
    by_q, by_qdot, by_activation, *by_parameter = _slopes(simulation, q, qdot, at_stages(activation), course, list(wrt))
    # Others than q and qdot: states of activation, then parameters.
    by_other = by_q.new_zeros(size - 2 + len(wrt), *by_q.shape)
    for slope, found in zip(by_other[size - 2 :], by_parameter, strict=True):
        slope.copy_(found)
    of_later = later.new_zeros(2 + len(by_other), *later.shape)  # states of activation do not see the motion
    for columns, of_points, of_states in _changes_of_activation(simulation, state, drive, steps, wrt):
        by_other[columns] += (by_activation * at_stages(of_points)).sum(-1)
        of_later[[2 + column for column in columns]] = of_states
    derivatives = torch.cat([_forced(by_q, by_qdot, by_other, drive.pieces), of_later.movedim(0, -1)], -2)
    return after, derivatives


def _changes_of_activation(
    simulation: Simulation, state: Tensor, drive: Drive, steps: slice, wrt: Mapping[str, float]
) -> Iterator[tuple[list[int], Tensor, Tensor]]:
    """How D of the states of activation and P parameters change what `_activated` gives, by differences: their places,
    and the two, (D, ..., T, n, 3 S, M) and (D, ..., T, n, K - 2)."""
    axes, rest = state.ndim - 2, state.shape[-1] - 2
    early = _early(drive)
    activation, later = _activated(simulation, state, early, drive.pieces)
    if rest:
        bumps = NUDGE * torch.eye(2 + rest, dtype=state.dtype, device=state.device)[2:]
        bumped = state + bumps.reshape(rest, *(1,) * (axes + 1), -1)
        moved = _activated(simulation, bumped, early, drive.pieces)
        yield [*range(rest)], (moved[0] - activation) / NUDGE, (moved[1] - later) / NUDGE
    for columns, nudged, nudges in _nudged_copies(simulation, wrt, NUDGE, axes, (True,)):
        by = nudges.reshape(-1, *(1,) * (axes + 2))
        inside = (_inside(x, steps, simulation.breakpoints) for x in (simulation, nudged))
        pairs = zip((simulation, nudged), inside, strict=True)
        still, pushed = (_activated(x, state, points, drive.pieces)[0] for x, points in pairs)
        # Pushes are compared at fixed times. Where a state gets to is seen from pieces that end with its own delay.
        part = nudged.drive.part(steps)
        of_states = _activated(nudged, state, _early(part), part.pieces)[1] - later
        yield [rest + column for column in columns], (pushed - still) / by.unsqueeze(-1), of_states / by


def _early(drive: Drive) -> tuple[Tensor, Tensor]:
    """Excitation and activation before effects with states, at the beginning, middle and end of each piece, (..., T, n,
    3 S, M)."""
    return drive.excitation[..., _ends(drive), :], drive.activation[..., _ends(drive), :]


def _ends(drive: Drive) -> list[int]:
    """Places of these among the points of a drive, where one piece ends as the next begins."""
    return [2 * piece + point for piece in range(drive.pieces.shape[-1]) for point in range(3)]


def _activated(
    simulation: Simulation, state: Tensor, early: tuple[Tensor, Tensor], pieces: Tensor
) -> tuple[Tensor, Tensor]:
    """Activation behind all effects at the beginning, middle and end of each piece, (..., T, n, 3 S, M), and the states
    of effects after the steps (..., T, n, K - 2), from what `_early` gives."""
    model, valued = simulation.model, simulation.along_time
    if not model.places["late_activation"]:
        return early[1], state[..., 2:]
    _, _, states = unpack(model, state)
    points: list[Tensor] = []
    instants = [Instant(valued, u, a) for u, a in zip(*(x.unbind(-2) for x in early), strict=True)]
    for piece, h in enumerate(pieces.unbind(-1)):
        found, states = advance_activation(instants[3 * piece : 3 * piece + 3], states, h.unsqueeze(-1))
        points += found
    ahead = [x.movedim(-1, 0) for x in torch.broadcast_tensors(*points)]  # as in `muscle_quantities`
    return torch.stack(ahead, 1).movedim((0, 1), (-1, -2)), torch.cat(torch.broadcast_tensors(*states.values()), -1)


def _slopes(
    simulation: Simulation, q: Tensor, qdot: Tensor, activation: Tensor, course: Tensor | None, names: Sequence[str]
) -> list[Tensor]:
    """Derivatives of the acceleration at the stages of all pieces.

    Args:
        q, qdot: (..., T, n, S, 4); activation (..., T, n, S, 4, M) and what is known over time (..., T, n, S, 4, V).

    Returns:
        Derivatives by q, by qdot, by the activation, of their shapes, and by each parameter, (..., T, n, S, 4).
    """
    with torch.enable_grad():
        q, qdot = (x.detach().requires_grad_() for x in (q, qdot))
        a = _leaf(activation, q.shape, muscles=1)
        valued, leaves = _valued_at(simulation, names, q.shape, axes=3)
        found = torques(valued.timed(course), q, qdot, a.movedim(0, -1), {}).acceleration
    by_q, by_qdot, by_a, *by_parameter = _derivatives(found, [q, qdot, a, *leaves])
    return [by_q, by_qdot, by_a.movedim(0, -1), *by_parameter]


def _forced(by_q: Tensor, by_qdot: Tensor, by_other: Tensor, pieces: Tensor) -> Tensor:
    """Derivatives of q and qdot (..., T, n, 2, 2 + C) by those at the beginning of the pieces (..., T, 1, S) and by
    others, that change the acceleration by `by_other` (C, ..., T, n, S, 4): a linear equation."""
    by_other = torch.nn.functional.pad(by_other, (0, 0) * by_q.ndim + (2, 0))
    q, qdot = torch.zeros_like(by_other[..., 0, 0]), torch.zeros_like(by_other[..., 0, 0])
    q[0], qdot[1] = 1.0, 1.0
    for piece, h in enumerate(pieces.unbind(-1)):

        def accelerate(stage: int, q: Tensor, qdot: Tensor, piece: int = piece) -> Tensor:
            slope_q, slope_qdot, forcing = (x[..., piece, stage] for x in (by_q, by_qdot, by_other))
            return slope_q * q + slope_qdot * qdot + forcing

        q, qdot = runge_kutta(accelerate, q, qdot, h)
    return torch.stack([q, qdot], -1).movedim(0, -1)


def _by_steps(
    simulation: Simulation, state: Tensor, drive: Drive, steps: slice, wrt: Mapping[str, float]
) -> tuple[Tensor, Tensor]:
    """Where steps lead, and the derivatives by their beginning and by parameters, (..., T, n, K) and
    (..., T, n, K, K + P)."""
    model, size = simulation.model, state.shape[-1]
    shape = state.shape[:-1]
    with torch.enable_grad():
        begin = state.detach().movedim(-1, 0).contiguous().requires_grad_()
        u, a = (_leaf(x, shape, muscles=2) for x in _early(drive))
        valued, leaves = _valued_at(simulation, list(wrt), shape, axes=1)
        timed = drive.instants(valued)
        at = zip(_ends(drive), u.movedim(0, -1), a.movedim(0, -1), strict=True)
        instants = [Instant(timed[place].valued, u_at, a_at) for place, u_at, a_at in at]
        q, qdot, states = unpack(model, begin.movedim(0, -1))
        for piece, h in enumerate(drive.pieces.unbind(-1)):
            q, qdot, states = advance(instants[3 * piece : 3 * piece + 3], states, q, qdot, h)
        after = pack(model, q, qdot, states)
        numbers = [_derivatives(after[..., k], [begin, u, a, *leaves], kept=k + 1 < size) for k in range(size)]
    by_state, by_u, by_a, *by_parameter = (torch.stack(slopes) for slopes in zip(*numbers, strict=True))
    derivatives = torch.stack([*by_state.unbind(1), *by_parameter], -1).movedim(0, -2)
    for columns, nudged, nudges in _nudged_copies(simulation, wrt, NUDGE, state.ndim - 2, (True,)):
        pairs = zip(*(_inside(x, steps, simulation.breakpoints) for x in (simulation, nudged)), strict=True)
        for slope, (still, moved) in zip((by_u, by_a), pairs, strict=True):
            change = ((moved - still) / nudges.reshape(-1, *(1,) * (state.ndim + 1))).unflatten(-2, (-1, 3))
            slope = slope.movedim((1, 2), (-1, -2)).unflatten(-2, (-1, 3))  # (K, ..., T, n, S, 3, M)
            added = (slope * change.unsqueeze(1)).sum((-1, -2, -3))
            derivatives[..., [size + column for column in columns]] += added.movedim((0, 1), (-1, -2))
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
    params = along(values, axes, simulation.emg)
    leaves = {name: params[name].expand(shape).contiguous().requires_grad_() for name in names}
    return give_values(simulation.model, params | leaves, simulation.emg), [*leaves.values()]


def _derivatives(of: Tensor, by: Sequence[Tensor], *, kept: bool = False) -> list[Tensor]:
    """Derivatives of what stands at each point by what stands there; 0 by what nothing depends on.

    Args:
        kept: whether more derivatives of the same values are to follow.
    """
    found = torch.autograd.grad(of.sum(), by, allow_unused=True, retain_graph=kept)
    return [torch.zeros_like(x) if slope is None else slope for x, slope in zip(by, found, strict=True)]


def _inside(simulation: Simulation, steps: slice, split: Tensor) -> tuple[Tensor, Tensor]:
    """Excitation and activation at the beginning, middle and end of the pieces of steps, a little inside, (..., T, n,
    3 S, M).

    Args:
        split: where the steps are split, as `Simulation.breakpoints`; of copies with other delays those of the first.
    """
    begin, length = split[..., :-1, None], torch.diff(split, dim=-1)[..., None]
    inside = torch.tensor([INSIDE, 0.5, 1 - INSIDE], dtype=split.dtype, device=split.device)
    within = (begin + length * inside).flatten(-2)  # (..., T, 3 S)
    start = torch.arange(steps.start, steps.stop, dtype=split.dtype, device=split.device)
    return simulation.activate(start[:, None, None] + within[..., None, :, None])
