"""The same motion as `motion.simulate`, for all samples at once, and its exact sensitivities.

One step of the integrator is a map x[n+1] = F(x[n]). Instead of walking along it, solve all N - 1 equations together
by Newton's method: each iteration evaluates F and its Jacobian for every sample in one batch, then runs a linear
recursion. From a near guess (the measured angle, or the motion at neighbouring parameters) two to four
iterations reach the integrator's own result to rounding, at the price of a few large array operations rather than
thousands of small ones; and the recursion gives the derivatives with respect to parameters and initial state for
little more. (Lim et al. 2024, "Parallelizing non-linear sequential models over the sequence length", known as DEER.)

Shapes: ... batch, T trials, N samples, M muscles, K numbers of the state, P parameters.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from myowave.physics.model import Model, Params, bind, observe
from myowave.physics.motion import Motion, batch_shape, drive_muscles, initial_state, simulate, step

TOLERANCE = 1e-9  # of the state, rad and rad/s
NUDGE = 1e-6  # relative step of the one-sided differences; their error is far below what a fit needs


@dataclass(frozen=True)
class Sensitive:
    """A motion with its derivatives.

    Args:
        motion: angle and state, (..., T, N) and (..., T, N, K).
        by_parameter: d angle / d parameter, (P, ..., T, N), in the order asked for.
        by_start: d angle / d (q0, qdot0), (2, ..., T, N).
    """

    motion: Motion
    by_parameter: Tensor
    by_start: Tensor


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
    iterations: int = 12,
) -> Sensitive:
    """Motion and sensitivities for every sample at once.

    Args:
        params, emg, dt, q0, qdot0, substeps: as for `motion.simulate`; everything in double precision.
        guess: state to start from, broadcastable to (..., T, N, K); by default the integrator's own result. Where
            Newton's method does not converge from it, the integrator's result is used.
        wrt: parameters to differentiate by, with the size of a usual change of each (sets the step of differences).

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
    raised = bound.along(1)

    def defect(at: Tensor) -> tuple[Tensor, Tensor]:
        """How far each step misses the next state (..., T, N-1, K), and its Jacobian (..., T, N-1, K, K)."""
        before = at[..., :-1, :]
        bumps = torch.diag_embed(torch.full((model.state_size,), NUDGE, dtype=at.dtype, device=at.device))
        copies = torch.cat([before.unsqueeze(0), before + bumps.reshape(-1, *(1,) * (before.ndim - 1), before.shape[-1])])
        after = step(raised, copies, drive)
        jacobian = (after[1:] - after[0]) / NUDGE
        return after[0] - at[..., 1:, :], jacobian.movedim(0, -1)

    for _ in range(iterations):
        miss, jacobian = defect(state)
        change = _recur(jacobian, miss.unsqueeze(-1), torch.zeros_like(start).unsqueeze(-1)).squeeze(-1)
        state = state + change
        size = change.detach().abs().amax()
        if not torch.isfinite(size) or size < TOLERANCE:
            break
    if guess is not None and not (torch.isfinite(size) and size < TOLERANCE):
        return solve(model, params, emg, dt, q0, qdot0, wrt=wrt, substeps=substeps, iterations=iterations)
    motion = Motion(observe(raised, state[..., 0], state[..., 1], dt), state)
    return _differentiate(model, params, emg, dt, q0, qdot0, motion, jacobian, wrt, substeps)


def _differentiate(
    model: Model,
    params: Params,
    emg: Tensor,
    dt: float,
    q0: Tensor,
    qdot0: Tensor,
    motion: Motion,
    jacobian: Tensor,
    wrt: Mapping[str, float],
    substeps: int,
) -> Sensitive:
    """Run the linearised recursion along a converged motion for each parameter and for the initial state."""
    state = motion.state
    before = state[..., :-1, :]
    forcing, starts, bounds = [], [], []
    base = bind(model, params, emg)
    base_drive = drive_muscles(base, emg, dt, substeps)
    base_start = initial_state(base, base_drive, q0, qdot0)
    after = state[..., 1:, :]
    for name, scale in wrt.items():
        nudge = NUDGE * scale
        moved = {**params, name: torch.as_tensor(params.get(name, model.defaults[name]), dtype=emg.dtype) + nudge}
        bound = bind(model, moved, emg)
        drive = drive_muscles(bound, emg, dt, substeps)
        raised = bound.along(1)
        forcing.append((step(raised, before, drive) - after) / nudge)  # `after` is this step of the converged motion
        starts.append((initial_state(bound, drive, q0, qdot0) - base_start) / nudge)
        bounds.append((raised, nudge))
    for shift in ((NUDGE, 0.0), (0.0, NUDGE)):
        moved_start = initial_state(base, base_drive, q0 + shift[0], qdot0 + shift[1])
        forcing.append(torch.zeros_like(after))
        starts.append((moved_start - base_start) / NUDGE)
    tangent = _recur(jacobian, torch.stack(forcing, -1), torch.stack(starts, -1))
    bounds += [(base.along(1), NUDGE)] * 2
    derivatives = []
    for i, (raised, nudge) in enumerate(bounds):
        moved_state = state + nudge * tangent[..., i]
        angle = observe(raised, moved_state[..., 0], moved_state[..., 1], dt)
        derivatives.append((angle - motion.angle) / nudge)
    derivatives = torch.stack([d.expand(motion.angle.shape) for d in derivatives])
    return Sensitive(motion, derivatives[: len(wrt)], derivatives[len(wrt) :])


def _recur(jacobian: Tensor, forcing: Tensor, start: Tensor) -> Tensor:
    """y[n+1] = J[n] y[n] + f[n] for every column of f.

    Args:
        jacobian: (..., N - 1, K, K).
        forcing: (..., N - 1, K, P).
        start: y[0], (..., K, P).

    Returns:
        y, (..., N, K, P).
    """
    jacobian = jacobian.movedim(-3, 0).contiguous()
    forcing = forcing.movedim(-3, 0).contiguous()
    y = start
    rows: Sequence[Tensor] = [y]
    for j, f in zip(jacobian, forcing, strict=True):
        y = torch.matmul(j, y) + f
        rows.append(y)
    return torch.stack(rows, -3)
