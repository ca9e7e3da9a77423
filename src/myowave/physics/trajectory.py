"""The same motion as `motion.simulate`, for all samples at once, and its exact sensitivities.

One step of the integrator is a map x[n+1] = F(x[n]). Instead of walking along it, solve all N - 1 equations together
by Newton's method: each iteration evaluates F and its Jacobian for every sample in one batch, then runs a linear
recursion. From a near guess (the measured angle, or the motion at neighbouring parameters) two to four
iterations reach the integrator's own result to rounding, at the price of a few large array operations rather than
thousands of small ones; and the recursion gives the derivatives with respect to parameters and initial state for
little more. (Lim et al. 2024, "Parallelizing non-linear sequential models over the sequence length", known as DEER.)

Shapes: ... batch, T trials, N samples, M muscles, K numbers of the state, P parameters.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from myowave.physics.model import Bound, Model, Params, bind, observe
from myowave.physics.motion import Drive, Motion, batch_shape, drive_muscles, initial_state, simulate, step

TOLERANCE = 1e-9  # of the state, rad and rad/s
NUDGE = 1e-6  # relative step of the one-sided differences; their error is far below what a fit needs


@dataclass(frozen=True)
class Linear:
    """The map from each sample to the next and its Jacobian, where Newton's method last evaluated them.

    Args:
        at: the state there, (..., T, N, K).
        after: F(at[n]), (..., T, N - 1, K).
        jacobian: dF/dx, (..., T, N - 1, K, K).
    """

    at: Tensor
    after: Tensor
    jacobian: Tensor


@dataclass(frozen=True)
class Sensitive:
    """A motion with its derivatives.

    Args:
        motion: angle and state, (..., T, N) and (..., T, N, K).
        by_parameter: d angle / d parameter, (P, ..., T, N), in the order asked for.
        by_start: d angle / d (q0, qdot0), (2, ..., T, N).
        tangent: d state / d (parameters, q0, qdot0), (..., T, N, K, P + 2).
        gap: size of Newton's last change [rad, rad/s]: how far the state may be from a motion.
        linear: the linearised motion, from which `derivatives_of` gives more derivatives.
    """

    motion: Motion
    by_parameter: Tensor
    by_start: Tensor
    tangent: Tensor
    gap: float
    linear: Linear


def solve(
    model: Model,
    params: Params,
    emg: Tensor,
    dt: float,
    q0: Tensor,
    qdot0: Tensor,
    *,
    guess: Tensor | None = None,
    wrt: Mapping[str, float] | None = None,
    substeps: int = 1,
    iterations: int = 25,
    tolerance: float = TOLERANCE,
    rescue: bool = True,
) -> Sensitive:
    """Motion and sensitivities for every sample at once.

    Args:
        params, emg, dt, q0, qdot0, substeps: as for `motion.simulate`; everything in double precision.
        guess: state to start from, broadcastable to (..., T, N, K); by default the integrator's own result. Where
            Newton's method does not converge from it, the integrator's result is used.
        wrt: parameters to differentiate by, with the size of a usual change of each (sets the step of differences).
        iterations: of Newton's method. With 1 the result is the first-order correction of `guess` towards a motion,
            whatever is left of the gap, and the derivatives are those at `guess`.
        tolerance: of the state; derivatives are accurate to about ten times its square root.
        rescue: whether to integrate sample after sample where Newton's method does not converge, which is slow;
            otherwise look at `gap`.

    Raises:
        ValueError: as `motion.simulate`.
    """
    assert emg.dtype == torch.float64, "sensitivities by differences need double precision"
    wrt = dict(wrt or {})
    bound = bind(model, params, emg)
    drive = drive_muscles(bound, emg, dt, substeps)
    batch = batch_shape(bound, drive, q0, qdot0)
    q0, qdot0 = q0.expand(batch), qdot0.expand(batch)
    start = initial_state(bound, drive, q0, qdot0)
    if guess is None:
        state = simulate(model, params, emg, dt, q0, qdot0, substeps=substeps).state
    else:
        state = guess.expand(*batch, *guess.shape[-2:]).clone()
    state[..., 0, :] = start
    state, gap, linear = _newton(bound.along(1), drive, state, iterations, tolerance)
    if guess is not None and iterations > 1 and rescue and not gap < tolerance:
        return solve(model, params, emg, dt, q0, qdot0, wrt=wrt, substeps=substeps, iterations=iterations)
    motion = Motion(observe(bound.along(1), state[..., 0], state[..., 1], dt), state)
    tangent = _tangents(model, params, emg, dt, linear, [*wrt.items()], substeps, NUDGE, starts=True)
    derivatives = _observed(model, params, emg, dt, linear, [*wrt.items()], tangent)
    return Sensitive(motion, derivatives[: len(wrt)], derivatives[len(wrt) :], tangent, gap, linear)


def derivatives_of(
    model: Model,
    params: Params,
    emg: Tensor,
    dt: float,
    linear: Linear,
    wrt: Mapping[str, float],
    substeps: int = 1,
    reach: float = NUDGE,
) -> tuple[Tensor, Tensor]:
    """Derivatives of a solved motion by parameters of a richer model that moves in the same way.

    An effect at 0 changes nothing, so the motion of the model without it will do, and its Jacobian too: one
    evaluation of the step for each parameter is all it takes. The effect must have no state of its own.

    Args:
        model, params: the richer model; its further parameters are at 0.
        linear: of the motion solved without them.
        wrt: parameters, with the size of a usual change of each.
        reach: step of the differences in units of that size. A large one takes the secant of the step, which sees
            parameters without a first derivative at 0, such as a pennation angle.

    Returns:
        d angle / d parameter (P, ..., T, N), and d state / d parameter (..., T, N, K, P).
    """
    assert model.state_size == linear.at.shape[-1], "the richer model has another state"
    tangent = _tangents(model, params, emg, dt, linear, [*wrt.items()], substeps, reach, starts=False)
    return _observed(model, params, emg, dt, linear, [*wrt.items()], tangent, reach), tangent


def _newton(
    bound: Bound, drive: Drive, state: Tensor, iterations: int, tolerance: float
) -> tuple[Tensor, float, Linear]:
    """Close the gaps between the samples of a state whose first sample is right.

    A Jacobian is used again as long as it makes the change shrink tenfold. Returns the state, the last change, and the
    linearisation at the state before that change.
    """
    bumps = NUDGE * torch.eye(state.shape[-1], dtype=state.dtype, device=state.device)
    bumps = bumps.reshape(-1, *(1,) * (state.ndim - 1), state.shape[-1])
    still = torch.zeros_like(state[..., 0, :]).unsqueeze(-1)
    stale_limit = 10 * tolerance**0.5
    gap, stale, refresh = math.inf, math.inf, True
    for _ in range(iterations):
        before = state[..., :-1, :]
        if refresh:
            copies = step(bound, torch.cat([before.unsqueeze(0), before + bumps]), drive)
            after, jacobian, stale = copies[0], ((copies[1:] - copies[0]) / NUDGE).movedim(0, -1), 0.0
        else:
            after = step(bound, before, drive)
        linear = Linear(state, after, jacobian)
        change = _recur(jacobian, (after - state[..., 1:, :]).unsqueeze(-1), still).squeeze(-1)
        state = state + change
        shrinks = (size := float(change.detach().abs().amax())) < 0.1 * gap
        gap = size
        if not math.isfinite(gap) or (gap < tolerance and stale < stale_limit):
            break
        refresh = not shrinks or gap > 0.1 or gap < tolerance
        stale += gap
    return state, gap, linear


def _tangents(
    model: Model,
    params: Params,
    emg: Tensor,
    dt: float,
    linear: Linear,
    wrt: list[tuple[str, float]],
    substeps: int,
    reach: float,
    *,
    starts: bool,
) -> Tensor:
    """d state / d parameters [and q0, qdot0], (..., T, N, K, P [+ 2]): the linearised recursion along a motion."""
    before, after = linear.at[..., :-1, :], linear.after
    q0, qdot0 = linear.at[..., 0, 0], linear.at[..., 0, 1]
    base = bind(model, params, emg)
    base_drive = drive_muscles(base, emg, dt, substeps)
    base_start = initial_state(base, base_drive, q0, qdot0)
    forcing = after.new_zeros(*after.shape, len(wrt) + (2 if starts else 0))
    begin = base_start.new_zeros(*base_start.shape, forcing.shape[-1])
    for drives in (True, False):  # parameters that change the muscles' drive, and those that leave it; each one batch
        group = [i for i, (name, _) in enumerate(wrt) if _drives(model, name) == drives]
        if group:
            nudged, nudges = _nudged(model, params, [wrt[i] for i in group], reach, q0)
            bound = bind(model, nudged, emg)
            drive = drive_muscles(bound, emg, dt, substeps) if drives else base_drive
            moved = step(bound.along(1), before, drive) - after
            forcing[..., group] = (moved / nudges.reshape(-1, *(1,) * after.ndim)).movedim(0, -1)
            shifted = initial_state(bound, drive, q0, qdot0) - base_start
            begin[..., group] = (shifted / nudges.reshape(-1, *(1,) * base_start.ndim)).movedim(0, -1)
    for i, shift in enumerate(((NUDGE, 0.0), (0.0, NUDGE)) if starts else (), start=len(wrt)):
        begin[..., i] = (initial_state(base, base_drive, q0 + shift[0], qdot0 + shift[1]) - base_start) / NUDGE
    return _recur(linear.jacobian, forcing, begin)


def _observed(
    model: Model,
    params: Params,
    emg: Tensor,
    dt: float,
    linear: Linear,
    wrt: list[tuple[str, float]],
    tangent: Tensor,
    reach: float = NUDGE,
) -> Tensor:
    """Derivatives of the observed angle (P [+ 2], ..., T, N) from those of the state, by parameters [and the start]."""
    if not model.on("observation"):
        return tangent[..., 0, :].movedim(-1, 0)
    bound = bind(model, params, emg).along(1)
    nudged, nudges = _nudged(model, params, wrt, reach, linear.at[..., 0, 0])
    moving = bind(model, nudged, emg).along(1)
    nudges = torch.cat([nudges, nudges.new_full((tangent.shape[-1] - len(wrt),), NUDGE)])
    nudges = nudges.reshape(-1, *(1,) * (linear.at.ndim - 1))
    moved = linear.at + nudges.unsqueeze(-1) * tangent.movedim(-1, 0)
    parts = ((moving, moved[: len(wrt)]), (bound, moved[len(wrt) :]))
    angles = torch.cat([observe(values, at[..., 0], at[..., 1], dt) for values, at in parts if len(at)])
    return (angles - observe(bound, linear.at[..., 0], linear.at[..., 1], dt)) / nudges


def _nudged(
    model: Model, params: Params, wrt: list[tuple[str, float]], reach: float, like: Tensor
) -> tuple[dict[str, Tensor], Tensor]:
    """Parameters with one more axis in front, along which one after the other is nudged, and the nudges (P,).

    Args:
        like: a tensor (..., T).
    """
    nudges = reach * torch.tensor([scale for _, scale in wrt], dtype=like.dtype, device=like.device)
    moved = dict(params)
    for name, shift in zip((name for name, _ in wrt), torch.diag(nudges), strict=True):
        value = torch.as_tensor(params.get(name, model.defaults[name]), dtype=like.dtype, device=like.device)
        moved[name] = value + shift.reshape(-1, *(1,) * like.ndim)
    return moved, nudges


def _drives(model: Model, name: str) -> bool:
    """Whether a parameter changes the drive of the muscles."""
    effect = next((e for e in model.effects if name in model.parameters_of(e)), None)
    if effect is None:
        return name.startswith(("delay_", "shape_"))
    return effect.acts_on in ("excitation", "activation", "constants")


def _recur(jacobian: Tensor, forcing: Tensor, start: Tensor) -> Tensor:
    """y[n+1] = J[n] y[n] + f[n] for every column of f.

    The samples are cut into chunks that are walked side by side for y[first] = 0 and for the transition matrix, and
    then joined: some 2 sqrt(N) small operations instead of N.

    Args:
        jacobian: (..., N - 1, K, K).
        forcing: (..., N - 1, K, P).
        start: y[0], (..., K, P).

    Returns:
        y, (..., N, K, P).
    """
    steps, size = jacobian.shape[-3], jacobian.shape[-1]
    length = max(1, round((steps / 2) ** 0.5))
    chunks = -(-steps // length)
    spare = chunks * length - steps  # steps added at the end, whose results are dropped
    batch = torch.broadcast_shapes(jacobian.shape[:-3], forcing.shape[:-3], start.shape[:-2])
    jacobian, forcing = (x.expand(*batch, *x.shape[-3:]) for x in (jacobian, forcing))
    jacobian, forcing = (torch.nn.functional.pad(x, (0, 0, 0, 0, 0, spare)) for x in (jacobian, forcing))
    jacobian = jacobian.unflatten(-3, (chunks, length)).movedim(-3, 0).contiguous()  # (length, ..., chunks, K, K)
    forcing = forcing.unflatten(-3, (chunks, length)).movedim(-3, 0)
    forcing = torch.nn.functional.pad(forcing, (size, 0)).contiguous()  # the first K columns: the transition matrix
    walked = [torch.eye(size, forcing.shape[-1], dtype=forcing.dtype, device=forcing.device).expand_as(forcing[0])]
    for j, f in zip(jacobian.unbind(0), forcing.unbind(0), strict=True):
        walked.append(torch.matmul(j, walked[-1]) + f)
    inside = torch.stack(walked[1:], -3)  # (..., chunks, length, K, K + P)
    joined = [start.expand(*batch, *start.shape[-2:])]
    for last in inside[..., -1, :, :].unbind(-3)[:-1]:
        joined.append(torch.matmul(last[..., :size], joined[-1]) + last[..., size:])
    begin = torch.stack(joined, -3).unsqueeze(-3)  # (..., chunks, 1, K, P)
    y = torch.matmul(inside[..., :size], begin) + inside[..., size:]
    return torch.cat([joined[0].unsqueeze(-3), y.flatten(-4, -3)[..., :steps, :, :]], -3)
