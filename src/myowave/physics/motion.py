"""From EMG to motion: the drive of the muscles, one time step, and the integrator (a reference, sample after sample).

EMG is linear between samples, so activation has a kink where a sample, shifted by the muscle's delay, falls inside
a step. A step is split at those kinks and each piece is one or more Runge-Kutta steps: fourth order on noisy EMG too.

Shapes: ... batch, T trials, N samples, D points within a step, M muscles, K numbers of the state.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from myowave.physics.effect import Effect, call
from myowave.physics.model import (
    Bound,
    Model,
    Params,
    acceleration,
    bind,
    muscle_quantities,
    observe,
    on_muscles,
)
from myowave.physics.muscle import activation as activation_of

BUMP = 1e-6  # of an effect's state, to see how its target depends on it


@dataclass(frozen=True)
class Drive:
    """What drives the muscles, at the points of every step: beginning, middle and end of each of its S pieces.

    Args:
        excitation, activation: (..., T, N - 1, 2 S + 1, M); activation before effects that have states.
        pieces: length of each piece [s], (..., T, 1, S).
    """

    excitation: Tensor
    activation: Tensor
    pieces: Tensor

    def at(self, n: int) -> "Drive":
        """The drive of step n alone, without the axis of samples."""
        pieces = self.pieces.squeeze(-2)
        return Drive(self.excitation[..., n, :, :], self.activation[..., n, :, :], pieces)


@dataclass(frozen=True)
class Motion:
    """A simulated motion: `angle` as a sensor sees it, `q` and `qdot` of the joint [rad, rad/s], all (..., T, N);
    `state` holds q, qdot and the states of effects, (..., T, N, K)."""

    angle: Tensor
    state: Tensor

    @property
    def q(self) -> Tensor:
        return self.state[..., 0]

    @property
    def qdot(self) -> Tensor:
        return self.state[..., 1]


def excite(model: Model, emg: Tensor, delay: Tensor, position: Tensor, dt: float) -> Tensor:
    """Excitation u(t) = e(t - d) at positions within the record, Eq. 1.

    Args:
        emg: (..., T, N, M), the channel of each muscle [-], sampled every `dt` seconds.
        delay: (..., T, M) or (M,) [s].
        position: times in units of samples, (..., T, n, D, 1).

    Returns:
        (..., T, n, D, M).

    Source: Taneja et al. 2023, Eq. 1.
    """
    # ASSUME: a negative sample of EMG counts as 0 (a muscle cannot push), in generation and in identification alike.
    # ASSUME: EMG is linear between samples; before the first sample it holds the first value.
    emg = emg.clamp(min=0.0)
    samples = emg.shape[-2]
    delayed = position - (delay / dt)[..., None, None, :]
    delayed = delayed.clamp(0.0, samples - 1.0)
    flat = delayed.flatten(-3, -2)
    before = flat.floor().clamp(max=max(samples - 2.0, 0.0))
    axes = max(emg.dim(), flat.dim())  # take_along_dim broadcasts, but only among equally many axes
    emg, index = emg[(None,) * (axes - emg.dim())], before.long()[(None,) * (axes - flat.dim())]
    left = torch.take_along_dim(emg, index, dim=-2)
    right = torch.take_along_dim(emg, (index + 1).clamp(max=samples - 1), dim=-2)
    return (left + (flat - before) * (right - left)).unflatten(-2, delayed.shape[-3:-1])


def breakpoints(bound: Bound, dt: float, substeps: int) -> Tensor:
    """Where a step is split, as fractions of it: (..., T, S + 1) from 0 to 1, S pieces between the kinks."""
    phase = torch.frac(bound.muscle["delay"] / dt)
    if bool((phase == phase[..., :1]).all()):
        phase = phase[..., :1]
    if bool((phase < 1e-12).all()):
        phase = phase[..., :0]
    ends = phase.new_zeros(*phase.shape[:-1], 1)
    kinks = torch.cat([ends, phase.sort(dim=-1).values, ends + 1.0], dim=-1)
    inner = torch.arange(substeps, dtype=phase.dtype, device=phase.device) / substeps
    split = kinks[..., :-1, None] + torch.diff(kinks, dim=-1)[..., None] * inner
    return torch.cat([split.flatten(-2), ends + 1.0], dim=-1)


def drive_muscles(bound: Bound, emg: Tensor, dt: float, substeps: int = 1) -> Drive:
    """Excitation and activation of every muscle at the points of every step.

    Args:
        bound: with `axes` 0.
        emg: channels as the muscles name them, (..., T, N, M).
        dt: sampling interval [s].
        substeps: Runge-Kutta steps for each piece between kinks.
    """
    split = breakpoints(bound, dt, substeps)
    middle = (split[..., :-1] + split[..., 1:]) / 2
    points = torch.cat([torch.stack([split[..., :-1], middle], -1).flatten(-2), split[..., -1:]], -1)
    start = torch.arange(emg.shape[-2] - 1, dtype=emg.dtype, device=emg.device)
    position = start[:, None, None] + points[..., None, :, None]
    pieces = (torch.diff(split, dim=-1) * dt).unsqueeze(-2)
    excitation, activation = activate(bound, emg, position, dt)
    return Drive(excitation, activation, pieces)


def activate(bound: Bound, emg: Tensor, position: Tensor, dt: float) -> tuple[Tensor, Tensor]:
    """Excitation and activation (Eqs. 1-2) at positions (..., T, n, D, 1) in units of samples, each (..., T, n, D, M).

    Effects that act on the excitation, and those on the activation that come before one with a state, are in it.
    """
    raised = bound.along(2)
    excitation = excite(bound.model, emg, bound.muscle["delay"], position, dt)
    # As in `muscle_quantities`: time runs fastest in memory, then trials, points within a step, muscles.
    excitation = excitation.movedim((-1, -2), (0, 1)).contiguous().movedim((0, 1), (-1, -2))
    for effect in bound.model.on("excitation"):
        quantities = {"excitation": excitation, "side": raised.muscle["side"]}
        excitation = call(effect.function, quantities, raised.values(effect))
    activation = activation_of(excitation, raised.muscle["shape"])
    for effect in bound.model.on("activation"):
        if effect.stateful:
            break
        quantities = {"excitation": excitation, "activation": activation, "side": raised.muscle["side"]}
        activation = call(effect.function, quantities, raised.values(effect))
    return excitation, activation


def channels_of(model: Model, channels: tuple[str, ...], emg: Tensor) -> Tensor:
    """EMG with one entry a muscle, (..., T, N, M), from recorded channels (..., T, N, C).

    Raises:
        ValueError: if a muscle's channel was not recorded.
    """
    if missing := [f"{m.channel} (muscle {m.name})" for m in model.muscles if m.channel not in channels]:
        raise ValueError(
            f"the recording has no channel {', '.join(missing)}; it has {', '.join(channels)}. "
            "Name the muscle's channel in physics.muscles, or add the column."
        )
    return emg[..., [channels.index(m.channel) for m in model.muscles]]


def _late_activation(model: Model) -> tuple[Effect, ...]:
    """Effects on the activation from the first one with a state on: they act step by step."""
    effects = model.on("activation")
    first = next((i for i, e in enumerate(effects) if e.stateful), len(effects))
    return effects[first:]


Relaxation = Callable[[Mapping], tuple[Tensor, Tensor, Tensor]]


def _relax(relaxation: Relaxation, state: Tensor, step: Tensor, begin: Mapping, end: Mapping) -> Tensor:
    """Advance an effect's state y over `step` seconds of dy/dt = (target - y) / time constant.

    Exact where the target is linear in y and time and the time constant is constant, however short: with 0 the state
    is at its target. Second order otherwise, if the time constant depends on y through the sense of change alone.

    Source: exponential Rosenbrock-Euler, Hochbruck & Ostermann 2010, Exponential integrators, Sec. 2.4.
    """
    target0, rise0, fall0 = relaxation({**begin, "state": state})
    target1, rise1, fall1 = relaxation({**end, "state": state})
    bumped, *_ = relaxation({**begin, "state": state + BUMP})
    pull = (1 - (bumped - target0) / BUMP).clamp(min=0.1)  # how fast y - target changes with y
    gap0, gap1 = (target0 - state) / pull, (target1 - state) / pull  # to where y would be at its target
    rises = gap0 + gap1 > 0
    lag = torch.where(rises, rise0 + rise1, fall0 + fall1) / (2 * pull * step)
    closed = -torch.expm1(-1 / lag.clamp(min=1e-3))  # share of the gap that closes; 1 where the lag is short
    return state + closed * gap0 + (1 - lag * closed) * (gap1 - gap0)


def _relaxation_of(bound: Bound, effect: Effect) -> Relaxation:
    return lambda quantities: call(effect.relaxation, quantities, bound.values(effect))


def _advance_activation(
    bound: Bound, states: Mapping[str, Tensor], u: tuple[Tensor, ...], a: tuple[Tensor, ...], h: Tensor
) -> tuple[tuple[Tensor, ...], dict[str, Tensor]]:
    """Activation at the beginning, middle and end of a piece through effects with states, and their states there."""
    advanced, side = {}, bound.muscle["side"]
    for effect in _late_activation(bound.model):
        points = [{"excitation": ui, "activation": ai, "side": side} for ui, ai in zip(u, a, strict=True)]
        if effect.stateful:
            relaxation, begin = _relaxation_of(bound, effect), states[effect.name]
            middle = _relax(relaxation, begin, h / 2, points[0], points[1])
            end = _relax(relaxation, begin, h, points[0], points[2])
            points = [p | {"state": s} for p, s in zip(points, (begin, middle, end), strict=True)]
            advanced[effect.name] = end
        a = tuple(call(effect.function, p, bound.values(effect)) for p in points)
    return a, advanced


def _advance_muscles(
    bound: Bound, states: Mapping[str, Tensor], begin: Mapping, end: tuple[Tensor, Tensor, Tensor], h: Tensor
) -> Mapping[str, Tensor]:
    """States of effects on the stage `muscle`, `h` seconds later.

    Every stage of a Runge-Kutta step takes the states along to its own point: where a state follows at once, the
    force is then exactly the one without the effect.

    Args:
        begin: the quantities of the muscles where the states are known.
        end: q, qdot (...) and activation (..., M) where they are wanted.
    """
    later = muscle_quantities(bound, *end)
    h = h.unsqueeze(-1)
    return {
        e.name: _relax(_relaxation_of(bound, e), states[e.name], h, begin, later) for e in bound.model.tendon_effects
    }


def step(bound: Bound, state: Tensor, drive: Drive) -> Tensor:
    """The state one sample later.

    Args:
        bound: its `axes` as in `state`: 0 for one step of (..., T), 1 for all steps of (..., T, N - 1) at once.
        state: (..., K).
        drive: of these steps, activation (..., 2 S + 1, M).
    """
    model = bound.model
    q, qdot = state[..., 0], state[..., 1]
    states = _unpack(model, state)
    activation = drive.activation.unbind(-2)
    for s, h in enumerate(drive.pieces.unbind(-1)):
        points = slice(2 * s, 2 * s + 3)
        a = activation[points]
        if states:
            u = drive.excitation[..., points, :].unbind(-2)
            a, advanced = _advance_activation(bound, states, u, a, h.unsqueeze(-1))
            states = states | advanced
        q, qdot, tendons = _runge_kutta(bound, states, q, qdot, a, h)
        states = states | tendons
    return _pack(model, q, qdot, states)


def _runge_kutta(
    bound: Bound, states: Mapping[str, Tensor], q: Tensor, qdot: Tensor, a: tuple[Tensor, ...], h: Tensor
) -> tuple[Tensor, Tensor, Mapping[str, Tensor]]:
    """One classical step of fourth order: q, qdot and the states of effects on the stage `muscle`."""
    half, sixth = h / 2.0, h / 6.0
    tendons = bool(bound.model.tendon_effects)
    begin = muscle_quantities(bound, q, qdot, a[0]) if tendons else {}

    def advance(elapsed: Tensor, *end: Tensor) -> Mapping[str, Tensor]:
        return _advance_muscles(bound, states, begin, end, elapsed) if tendons else {}

    def accelerate(elapsed: Tensor, *end: Tensor) -> Tensor:
        return acceleration(bound, *end, advance(elapsed, *end))

    k1 = acceleration(bound, q, qdot, a[0], states)
    v2 = qdot + half * k1
    k2 = accelerate(half, q + half * qdot, v2, a[1])
    v3 = qdot + half * k2
    k3 = accelerate(half, q + half * v2, v3, a[1])
    v4 = qdot + h * k3
    k4 = accelerate(h, q + h * v3, v4, a[2])
    q = q + sixth * (qdot + 2.0 * (v2 + v3) + v4)
    qdot = qdot + sixth * (k1 + 2.0 * (k2 + k3) + k4)
    return q, qdot, advance(h, q, qdot, a[2])


def _unpack(model: Model, state: Tensor) -> dict[str, Tensor]:
    width = len(model.muscles)
    return {effect.name: state[..., 2 + i * width : 2 + (i + 1) * width] for i, effect in enumerate(model.stateful)}


def _pack(model: Model, q: Tensor, qdot: Tensor, states: Mapping[str, Tensor]) -> Tensor:
    motion = torch.stack(torch.broadcast_tensors(q, qdot), -1)
    parts = [states[effect.name] for effect in model.stateful]
    if not parts:
        return motion
    shape = torch.broadcast_shapes(motion.shape[:-1], *(p.shape[:-1] for p in parts))
    return torch.cat([x.expand(*shape, x.shape[-1]) for x in (motion, *parts)], -1)


def initial_state(bound: Bound, drive: Drive, q0: Tensor, qdot0: Tensor) -> Tensor:
    """State (..., T, K) at the first sample: the joint as given, the states of effects at rest there."""
    return _resting(bound, drive.excitation[..., 0, 0, :], drive.activation[..., 0, 0, :], q0, qdot0)


def resting_states(bound: Bound, drive: Drive, q: Tensor, qdot: Tensor) -> Tensor:
    """State (..., T, N, K) along a motion (..., T, N), the states of effects as if at rest at every sample."""
    u, a = (torch.cat([x[..., 0, :], x[..., -1:, -1, :]], -2) for x in (drive.excitation, drive.activation))
    return _resting(bound.along(1), u, a, q, qdot)


def _resting(bound: Bound, u: Tensor, a: Tensor, q: Tensor, qdot: Tensor) -> Tensor:
    model = bound.model
    states = {}
    for effect in _late_activation(model):
        quantities = {"excitation": u, "activation": a, "side": bound.muscle["side"]}
        if effect.stateful:
            states[effect.name] = quantities["state"] = _initial(bound, effect, quantities, a)
        a = call(effect.function, quantities, bound.values(effect))
    for effect in model.tendon_effects:
        states[effect.name] = _initial(bound, effect, muscle_quantities(bound, q, qdot, a), a)
    return _pack(model, q, qdot, states)


def _initial(bound: Bound, effect: Effect, quantities: Mapping, like: Tensor) -> Tensor:
    if effect.initial is None:
        return torch.zeros_like(like)
    return torch.broadcast_tensors(call(effect.initial, quantities, bound.values(effect)), like)[0]


def simulate(
    model: Model,
    params: Params,
    emg: Tensor,
    dt: float,
    q0: Tensor | float,
    qdot0: Tensor | float = 0.0,
    *,
    substeps: int = 1,
) -> Motion:
    """Integrate the equation of motion sample after sample; differentiable in the parameters and in the EMG.

    Args:
        params: values by name, each broadcastable to (..., T); the rest take the model's defaults.
        emg: one channel a muscle, (..., T, N, M), every `dt` seconds.
        q0, qdot0: joint angle and velocity at the first sample [rad, rad/s], broadcastable to (..., T).
        substeps: Runge-Kutta steps for each piece between two kinks of the activation.
    """
    bound = bind(model, params, emg)
    drive = drive_muscles(bound, emg, dt, substeps)
    q0, qdot0 = (torch.as_tensor(x, dtype=emg.dtype, device=emg.device) for x in (q0, qdot0))
    batch = batch_shape(bound, drive, q0, qdot0)
    states = [initial_state(bound, drive, q0.expand(batch), qdot0.expand(batch))]
    for n in range(emg.shape[-2] - 1):
        states.append(step(bound, states[-1], drive.at(n)))
    state = torch.stack(states, -2)
    return Motion(observe(bound.along(1), state[..., 0], state[..., 1], dt), state)


def batch_shape(bound: Bound, drive: Drive, q0: Tensor, qdot0: Tensor) -> torch.Size:
    """The shape (..., T) that drive, parameters and initial state broadcast to."""
    shapes = [v.shape[:-1] for v in bound.muscle.values()] + [v.shape for v in bound.joint.values()]
    for effect in bound.model.effects:
        values = bound.values(effect)
        shapes += [v.shape[:-1] if on_muscles(effect, name) else v.shape for name, v in values.items()]
    return torch.broadcast_shapes(drive.activation.shape[:-3], q0.shape, qdot0.shape, *shapes)
