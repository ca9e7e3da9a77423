"""Derivatives of a step of the integrator by its beginning and by parameters, of the first state, and of what is seen.

Those of a step by its beginning alone are differences. With parameters they are exact: each of many steps has
parameters of its own, so a pass backwards for each number of the state gives the derivatives of all of them by all.

Shapes: ... batch, T trials, N samples, n of the steps, S pieces of a step, M muscles, K numbers of the state,
P parameters.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from myowave.physics.motion import advance, initial_state, observe, pack, step, unpack
from myowave.physics.simulation import Drive, Instant, Simulation
from myowave.physics.valued import Valued, along, give_values

MOST_POINTS = 30_000  # evaluated at once
COSTLIER = 3  # evaluations of the muscles for each point where tendons have states, about
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
    if not wrt:
        linear = _by_differences(simulation, state)
        return linear, linear.after.new_zeros(*linear.after.shape, 0)
    drive, before, size = simulation.drive, state[..., :-1, :], state.shape[-1]
    evaluated = 4 * drive.pieces.shape[-1] * (COSTLIER if simulation.model.places["tendon"] else 1)
    length = max(1, MOST_POINTS // (evaluated * max(1, before[..., 0, 0].numel())))
    parts = []
    for first in range(0, before.shape[-2], length):
        steps = slice(first, min(first + length, before.shape[-2]))
        parts.append(_by_steps(simulation, before[..., steps, :], drive.part(steps), steps, wrt))
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
    parts = ((nudged, moved[: len(wrt)]), (simulation, moved[len(wrt) :]))
    angles = torch.cat([observe(some, at[..., 0], at[..., 1]) for some, at in parts if len(at)])
    return (angles - observe(simulation, linear.at[..., 0], linear.at[..., 1])) / nudges


def _nudged_copies(
    simulation: Simulation, wrt: Mapping[str, float], reach: float, axes: int, groups: Sequence[bool] = (True, False)
) -> Iterator[tuple[list[int], Simulation, Tensor]]:
    """Places of parameters in `wrt` with a copy for each, moved by its nudge; first those that change the drive of the
    muscles, as the others share it; of `groups` (True,) these alone."""
    for driving in groups:
        group = {name: size for name, size in wrt.items() if simulation.model.drives(name) is driving}
        if group:
            yield [i for i, name in enumerate(wrt) if name in group], *simulation.nudged(group, reach, axes)


def _by_steps(
    simulation: Simulation, state: Tensor, drive: Drive, steps: slice, wrt: Mapping[str, float]
) -> tuple[Tensor, Tensor]:
    """Where steps lead, and the derivatives by their beginning and by parameters, (..., T, n, K) and
    (..., T, n, K, K + P)."""
    model, size, shape = simulation.model, state.shape[-1], state.shape[:-1]
    # Beginning, middle and end of each piece among the points of the drive, where one ends as the next begins.
    places = [2 * piece + point for piece in range(drive.pieces.shape[-1]) for point in range(3)]
    with torch.enable_grad():
        begin = state.detach().movedim(-1, 0).contiguous().requires_grad_()
        u, a = (_leaf(x[..., places, :], shape) for x in (drive.excitation, drive.activation))
        valued, leaves = _valued_at(simulation, list(wrt), shape)
        timed = drive.instants(valued)
        at = zip(places, u.movedim(0, -1), a.movedim(0, -1), strict=True)
        instants = [Instant(timed[place].valued, u_at, a_at) for place, u_at, a_at in at]
        q, qdot, states = unpack(model, begin.movedim(0, -1))
        for piece, h in enumerate(drive.pieces.unbind(-1)):
            q, qdot, states = advance(instants[3 * piece : 3 * piece + 3], states, q, qdot, h)
        # Each number of the state by itself: of one packed together a pass would go back through all the others.
        after = [q, qdot, *(x for effect in model.stateful for x in states[effect.name].unbind(-1))]
        numbers = [_derivatives(x, [begin, u, a, *leaves], kept=x is not after[-1]) for x in after]
    by_state, by_u, by_a, *by_parameter = (torch.stack(slopes) for slopes in zip(*numbers, strict=True))
    derivatives = torch.stack([*by_state.unbind(1), *by_parameter], -1).movedim(0, -2)
    for columns, nudged, nudges in _nudged_copies(simulation, wrt, NUDGE, state.ndim - 2, (True,)):
        pairs = zip(*(_inside(x, steps, simulation.breakpoints) for x in (simulation, nudged)), strict=True)
        for slope, (still, moved) in zip((by_u, by_a), pairs, strict=True):
            change = ((moved - still) / nudges.reshape(-1, *(1,) * (state.ndim + 1))).unflatten(-2, (-1, 3))
            slope = slope.movedim((1, 2), (-1, -2)).unflatten(-2, (-1, 3))  # (K, ..., T, n, S, 3, M)
            added = (slope * change.unsqueeze(1)).sum((-1, -2, -3))
            derivatives[..., [size + column for column in columns]] += added.movedim((0, 1), (-1, -2))
    return pack(model, q, qdot, states).detach(), derivatives


def _leaf(values: Tensor, shape: Sequence[int]) -> Tensor:
    """Values (..., 3 S, M) as what derivatives are taken by; points and muscles in front, as
    `dynamics.muscle_quantities` has them."""
    values = values.expand(*shape, *values.shape[-2:]).movedim((-1, -2), (0, 1))
    return values.detach().contiguous().requires_grad_()


def _valued_at(simulation: Simulation, names: Sequence[str], shape: torch.Size) -> tuple[Valued, list[Tensor]]:
    """The model with values for steps of a shape, and those in `names`, one for each step."""
    values = {n: simulation.params.get(n, simulation.model.defaults[n]) for n in (*simulation.params, *names)}
    params = along(values, 1, simulation.emg)
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
