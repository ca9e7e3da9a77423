"""From a simulation to its motion: one time step, and the integrator (a reference, sample after sample).

Shapes: ... batch, T trials, N samples, M muscles, S pieces of a step, K numbers of the state.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from myowave.physics.dynamics import muscle_quantities, torques_with
from myowave.physics.effect import Acting
from myowave.physics.model import Model
from myowave.physics.simulation import Drive, Instant, Simulation
from myowave.physics.valued import Valued

BUMP = 1e-6  # of an effect's state, to see how its target depends on it
SHORTEST = 1e-15  # seconds; a piece of a step has length 0 where two muscles have the same delay and others do not


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


Relaxation = Callable[[Mapping[str, Any]], tuple[Tensor, Tensor, Tensor]]


@dataclass(frozen=True)
class Pull:
    """What drives an effect's state from where a piece of a step begins: dy/dt = (target - y) / time constant."""

    relaxation: Relaxation
    state: Tensor  # y there
    # target, rise, fall: what the relaxation gives there
    target: Tensor
    rise: Tensor
    fall: Tensor
    strength: Tensor  # how fast y - target changes with y

    @classmethod
    def at(cls, relaxation: Relaxation, state: Tensor, begin: Mapping[str, Any]) -> "Pull":
        target, rise, fall = relaxation({**begin, "state": state})
        bumped, *_ = relaxation({**begin, "state": state + BUMP})
        return cls(relaxation, state, target, rise, fall, (1 - (bumped - target) / BUMP).clamp(min=0.1))

    def relax(self, step: Tensor, end: Mapping[str, Any]) -> Tensor:
        """The state `step` seconds later, where the quantities are those of `end`.

        Exact where the target is linear in y and time and the time constant is constant, however short: with 0 the
        state is at its target. Second order otherwise.

        Source: exponential Rosenbrock-Euler, Hochbruck & Ostermann 2010, Exponential integrators, Sec. 2.4.
        """

        def closing(time_constant: Tensor) -> tuple[Tensor, Tensor]:
            """A time constant in steps, and the share of a gap that closes in one: 1 where it is short."""
            lag = time_constant / (self.strength * step.clamp(min=SHORTEST))
            return lag, -torch.expm1(-1 / lag.clamp(min=1e-3))

        # To where y would be at its target.
        gap0 = (self.target - self.state) / self.strength
        moved = closing(torch.where(gap0 > 0, self.rise, self.fall))[1] * gap0  # as if all stayed as it is
        target, rise, fall = self.relaxation({**end, "state": self.state + moved})
        gap1 = (target - self.state) / self.strength + (1 - 1 / self.strength) * moved
        lag, closed = closing(torch.where(gap0 + gap1 > 0, self.rise + rise, self.fall + fall) / 2)
        return self.state + closed * gap0 + (1 - lag * closed) * (gap1 - gap0)


def step(valued: Valued, state: Tensor, drive: Drive) -> Tensor:
    """The state (..., K) one sample later.

    Args:
        valued: of `Simulation.valued` for one step of (..., T), of `along_time` for many of (..., T, n) at once.
    """
    q, qdot, states = unpack(valued.model, state)
    instants = drive.instants(valued)
    for piece, h in enumerate(drive.pieces.unbind(-1)):
        q, qdot, states = advance(instants[2 * piece : 2 * piece + 3], states, q, qdot, h)
    return pack(valued.model, q, qdot, states)


def advance(
    instants: Sequence[Instant], states: Mapping[str, Tensor], q: Tensor, qdot: Tensor, h: Tensor
) -> tuple[Tensor, Tensor, Mapping[str, Tensor]]:
    """q, qdot and the states of effects after a piece of a step.

    Args:
        instants: its beginning, middle and end.
        h: its length [s].
    """
    valued = instants[0].valued
    activation, states = advance_activation(instants, states, h.unsqueeze(-1))
    tendons = valued.acting["tendon"]
    begin = muscle_quantities(valued, q, qdot, activation[0])
    pulls = {t.effect.name: Pull.at(t.relaxation, states[t.effect.name], begin) for t in tendons}

    def later(point: int, q: Tensor, qdot: Tensor) -> tuple[Mapping[str, Any], Mapping[str, Tensor]]:
        """Quantities of the muscles, and states of effects on the stage `muscle`, at the middle or the end.

        Every stage of a Runge-Kutta step takes them along to its own point: where a state follows at once, the force
        is then exactly the one without the effect.
        """
        muscles, elapsed = muscle_quantities(valued, q, qdot, activation[point]), (h * (point / 2)).unsqueeze(-1)
        return muscles, {name: pull.relax(elapsed, muscles) for name, pull in pulls.items()}

    def accelerate(point: int, q: Tensor, qdot: Tensor) -> Tensor:
        muscles, at = later(point, q, qdot) if point else (begin, states)
        return torques_with(instants[point].valued, q, qdot, muscles, at).acceleration

    q, qdot = runge_kutta(accelerate, q, qdot, h)
    return q, qdot, {**states, **later(2, q, qdot)[1]} if tendons else states


def advance_activation(
    instants: Sequence[Instant], states: Mapping[str, Tensor], h: Tensor
) -> tuple[list[Tensor], Mapping[str, Tensor]]:
    """Activation at the beginning, middle and end of a piece behind effects with states, and their states at its
    end."""
    pulls: dict[str, Pull] = {}

    def begin(acting: Acting, seen: Mapping[str, Tensor]) -> Tensor:
        name = acting.effect.name
        pulls[name] = Pull.at(acting.relaxation, states[name], seen)
        return states[name]

    first, _ = late_activation(instants[0], begin)
    middle, _ = late_activation(instants[1], lambda acting, seen: pulls[acting.effect.name].relax(h / 2, seen))
    end, after = late_activation(instants[2], lambda acting, seen: pulls[acting.effect.name].relax(h, seen))
    return [first, middle, end], {**states, **after}


def runge_kutta(
    accelerate: Callable[[int, Tensor, Tensor], Tensor], q: Tensor, qdot: Tensor, h: Tensor
) -> tuple[Tensor, Tensor]:
    """q and qdot after one classical step of fourth order.

    Args:
        accelerate: the acceleration at the beginning (0), the middle (1) or the end (2), for q and qdot there.
        h: length of the step [s].
    """
    half, sixth = h / 2.0, h / 6.0
    k1 = accelerate(0, q, qdot)
    v2 = qdot + half * k1
    k2 = accelerate(1, q + half * qdot, v2)
    v3 = qdot + half * k2
    k3 = accelerate(1, q + half * v2, v3)
    v4 = qdot + h * k3
    k4 = accelerate(2, q + h * v3, v4)
    return q + sixth * (qdot + 2.0 * (v2 + v3) + v4), qdot + sixth * (k1 + 2.0 * (k2 + k3) + k4)


def unpack(model: Model, state: Tensor) -> tuple[Tensor, Tensor, dict[str, Tensor]]:
    """q, qdot (...) and the states of effects by their names (..., M), from a state (..., K)."""
    width = len(model.muscles)
    states = {effect.name: state[..., 2 + i * width : 2 + (i + 1) * width] for i, effect in enumerate(model.stateful)}
    return state[..., 0], state[..., 1], states


def pack(model: Model, q: Tensor, qdot: Tensor, states: Mapping[str, Tensor]) -> Tensor:
    """A state (..., K) from what `unpack` makes of it."""
    motion = torch.stack(torch.broadcast_tensors(q, qdot), -1)
    parts = [states[effect.name] for effect in model.stateful]
    if not parts:
        return motion
    shape = torch.broadcast_shapes(motion.shape[:-1], *(p.shape[:-1] for p in parts))
    return torch.cat([x.expand(*shape, x.shape[-1]) for x in (motion, *parts)], -1)


def initial_state(simulation: Simulation, q0: Tensor, qdot0: Tensor) -> Tensor:
    """State (..., T, K) at the first sample: the joint as given, activation as the EMG before left it, tendons at rest.

    Where no EMG is known before, and where it begins, activation is at rest.
    """
    valued = simulation.valued
    first = simulation.drive.part(0).instants(valued)[0]
    if not (simulation.lead and valued.acting["late_activation"]):
        return _at(first, _resting, q0, qdot0)
    parts = [simulation.drive_before.part(n) for n in range(simulation.lead)]
    _, states = late_activation(parts[0].instants(valued)[0], _resting)
    for part in parts:
        instants = part.instants(valued)
        for piece, h in enumerate(part.pieces.unbind(-1)):
            _, states = advance_activation(instants[2 * piece : 2 * piece + 3], states, h.unsqueeze(-1))
    return _at(first, lambda acting, seen: states[acting.effect.name], q0, qdot0)


def resting_states(simulation: Simulation, q: Tensor, qdot: Tensor) -> Tensor:
    """State (..., T, N, K) along a motion (..., T, N), the states of effects as if at rest at every sample."""
    return _at(Instant(simulation.along_time, *simulation.drive.at_samples), _resting, q, qdot)


def late_activation(
    instant: Instant, state_of: Callable[[Acting, Mapping[str, Tensor]], Tensor]
) -> tuple[Tensor, dict[str, Tensor]]:
    """Activation behind effects with states, and these states by the effects' names.

    Args:
        state_of: the state of an effect, from the quantities of its stage.
    """
    states, valued, a = {}, instant.valued, instant.activation
    for acting in valued.acting["late_activation"]:
        quantities = {"excitation": instant.excitation, "activation": a, "side": valued.muscle["side"]}
        if acting.effect.stateful:
            states[acting.effect.name] = quantities["state"] = state_of(acting, quantities)
        a = acting(quantities)
    return a, states


def _resting(acting: Acting, seen: Mapping[str, Tensor]) -> Tensor:
    return acting.initial(seen, seen["activation"])


def _at(
    instant: Instant, state_of: Callable[[Acting, Mapping[str, Tensor]], Tensor], q: Tensor, qdot: Tensor
) -> Tensor:
    """A state (..., K) with the states of activation as `state_of` has them, tendons at rest."""
    valued = instant.valued
    a, states = late_activation(instant, state_of)
    for tendon in valued.acting["tendon"]:
        states[tendon.effect.name] = tendon.initial(muscle_quantities(valued, q, qdot, a), a)
    return pack(valued.model, q, qdot, states)


def simulate(simulation: Simulation, q0: Tensor | float, qdot0: Tensor | float = 0.0) -> Motion:
    """Integrate the equation of motion sample after sample; differentiable in the parameters and in the EMG.

    Args:
        q0, qdot0: joint angle and velocity at the first sample [rad, rad/s], broadcastable to (..., T).
    """
    emg = simulation.emg
    q0, qdot0 = (torch.as_tensor(x, dtype=emg.dtype, device=emg.device) for x in (q0, qdot0))
    batch = simulation.batch_shape(q0, qdot0)
    return walk(simulation, initial_state(simulation, q0.expand(batch), qdot0.expand(batch)))


def walk(simulation: Simulation, first: Tensor) -> Motion:
    """The motion from a first state (..., T, K), step after step; see `simulate`."""
    states = [first]
    for n in range(simulation.emg.shape[-2] - 1 - simulation.lead):
        states.append(step(simulation.valued, states[-1], simulation.drive.part(n)))
    return observed(simulation, torch.stack(states, -2))


def observed(simulation: Simulation, state: Tensor) -> Motion:
    """The motion whose states (..., T, N, K) are known, as a sensor sees it."""
    return Motion(observe(simulation, state[..., 0], state[..., 1]), state)


def observe(simulation: Simulation, q: Tensor, qdot: Tensor) -> Tensor:
    """The angle that a sensor reports [rad] for a motion (..., T, N), through the effects on `observation`."""
    begin = torch.as_tensor(simulation.begin, dtype=q.dtype, device=q.device).unsqueeze(-1)
    for effect in simulation.along_time.acting["observation"]:
        q = effect({"q": q, "qdot": qdot, "dt": simulation.dt, "begin": begin})
    return q
