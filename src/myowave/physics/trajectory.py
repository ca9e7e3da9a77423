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

from myowave.physics.motion import Motion, initial_state, observed, simulate, step
from myowave.physics.simulation import Simulation
from myowave.physics.tangent import NUDGE, Linear, derivatives_observed, derivatives_of_start, forcing_of, linearise

CURVATURE = 10.0  # what a change of size x by Newton's method leaves is at most about this times x^2 [rad, rad/s]
# ASSUME: where samples move so far [rad, rad/s] at first or twice in a row, no motion is found any more. In diagnoses
# of two recordings none of the 1,402 motions that were found did, and most of the 35 that were not.
HOPELESS = 1e5


@dataclass(frozen=True)
class Newton:
    """How far Newton's method goes."""

    # at most. With 1 the result is the first-order correction of the guess towards a motion, whatever is left of the
    # gap, and the derivatives are those at the guess.
    iterations: int = 25
    tolerance: float = 1e-9  # of the state [rad, rad/s]; derivatives are accurate to about ten times its square root
    # whether to integrate sample after sample, which is slow, where Newton's method does not converge from the guess;
    # otherwise look at `Sensitive.gap`
    rescue: bool = True


@dataclass(frozen=True)
class Sensitive:
    """A motion with its derivatives."""

    motion: Motion  # angle and state, (..., T, N) and (..., T, N, K)
    by_parameter: Tensor  # d angle / d parameter, (P, ..., T, N), in the order asked for
    by_start: Tensor  # d angle / d (q0, qdot0), (2, ..., T, N)
    tangent: Tensor  # d state / d (parameters, q0, qdot0), (..., T, N, K, P + 2)
    gap: float  # how far the state may be from a motion [rad, rad/s]; of a single step of Newton's method, its size
    linear: Linear  # the linearised motion, from which `derivatives_of` gives more derivatives


def solve(
    simulation: Simulation,
    q0: Tensor,
    qdot0: Tensor,
    *,
    guess: Tensor | None = None,
    wrt: Mapping[str, float] | None = None,
    newton: Newton = Newton(),
    near: Tensor | None = None,
) -> Sensitive:
    """Motion and sensitivities for every sample at once.

    Args:
        simulation: in double precision.
        q0, qdot0: joint angle and velocity at the first sample [rad, rad/s], broadcastable to (..., T).
        guess: state to start from, broadcastable to (..., T, N, K); by default the integrator's own result. Where
            Newton's method does not converge from it, the integrator's result is used.
        wrt: parameters to differentiate by, with the size of a usual change of each (sets the step of differences).
        near: Jacobian of the steps of a motion nearby, (..., T, N - 1, K, K): Newton's method begins with it.
    """
    assert simulation.emg.dtype == torch.float64, "sensitivities by differences need double precision"
    wrt = dict(wrt or {})
    batch = simulation.batch_shape(q0, qdot0)
    q0, qdot0 = q0.expand(batch), qdot0.expand(batch)
    start = initial_state(simulation, q0, qdot0)
    state = simulate(simulation, q0, qdot0).state if guess is None else guess
    state = state.expand(*batch, *state.shape[-2:]).clone()
    state[..., 0, :] = start
    state = _approach(simulation, state, newton, near)
    linear, forcing = linearise(simulation, state, wrt)
    change = _closing(linear.jacobian, linear.after, state)
    state, gap = state + change, float(change.abs().amax())
    if newton.iterations > 1:
        gap = CURVATURE * gap * gap  # infinite where it is no number any more; a power would raise
    if guess is not None and newton.iterations > 1 and newton.rescue and not gap < newton.tolerance:
        return solve(simulation, q0, qdot0, wrt=wrt, newton=Newton(newton.iterations))
    begin = derivatives_of_start(simulation, q0, qdot0, wrt)
    tangent = recur(linear.jacobian, torch.nn.functional.pad(forcing, (0, 2)), begin)
    derivatives = derivatives_observed(simulation, linear, wrt, tangent)
    motion = observed(simulation, state)
    return Sensitive(motion, derivatives[: len(wrt)], derivatives[len(wrt) :], tangent, gap, linear)


def derivatives_of(
    simulation: Simulation, linear: Linear, wrt: Mapping[str, float], reach: float = NUDGE
) -> tuple[Tensor, Tensor]:
    """Derivatives of a solved motion by parameters of a richer model that moves in the same way.

    An effect at 0 changes nothing, so the motion of the model without it will do, and its Jacobian too: one
    evaluation of the step for each parameter is all it takes. The effect must have no state of its own.

    Args:
        simulation: of the richer model; its further parameters are at 0.
        linear: of the motion solved without them.
        wrt: parameters, with the size of a usual change of each.
        reach: step of the differences in units of that size. A large one takes the secant of the step, which sees
            parameters without a first derivative at 0, such as a pennation angle.

    Returns:
        d angle / d parameter (P, ..., T, N), and d state / d parameter (..., T, N, K, P).
    """
    assert simulation.model.state_size == linear.at.shape[-1], "the richer model has another state"
    begin = derivatives_of_start(simulation, linear.at[..., 0, 0], linear.at[..., 0, 1], wrt, reach)[..., : len(wrt)]
    tangent = recur(linear.jacobian, forcing_of(simulation, linear, wrt, reach), begin)
    return derivatives_observed(simulation, linear, wrt, tangent, reach), tangent


def _approach(simulation: Simulation, state: Tensor, newton: Newton, jacobian: Tensor | None) -> Tensor:
    """Close the gaps between the samples of a state whose first sample is right, but for what one more step of Newton's
    method closes.

    A Jacobian is used again as long as no more steps are left with it, at the rate of the last, than another costs by
    differences, which is one for each number of the state.
    """
    gap, enough = math.inf, (newton.tolerance / CURVATURE) ** 0.5
    for _ in range(newton.iterations - 1):
        if jacobian is None:
            linear, _ = linearise(simulation, state, {})
            jacobian, after = linear.jacobian, linear.after
        else:
            after = step(simulation.along_time, state[..., :-1, :], simulation.drive)
        change = _closing(jacobian, after, state)
        state = state + change
        before, gap = gap, float(change.abs().amax())
        if not enough <= gap < math.inf or min(before, gap) > HOPELESS:
            break
        left = math.log(gap / enough) / math.log(before / gap) if gap < before else math.inf
        if left > state.shape[-1] or gap > 0.1:
            jacobian = None
    return state


def _closing(jacobian: Tensor, after: Tensor, state: Tensor) -> Tensor:
    """The change of a state (..., T, N, K) that closes the gaps between its samples, to first order."""
    still = torch.zeros_like(state[..., 0, :]).unsqueeze(-1)
    return recur(jacobian, (after - state[..., 1:, :]).unsqueeze(-1), still).squeeze(-1)


def recur(jacobian: Tensor, forcing: Tensor, start: Tensor) -> Tensor:
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
