"""A model of the elbow: muscles + joint + effects, and the equation of motion they add up to (Eqs. 5, 54).

    I(q) qddot = sum of muscle torques + gravity + torques of effects

Shapes: ... batch (hypotheses, starts, perturbations), T trials, N samples, D points within a sample step, M muscles.
"""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import torch
from torch import Tensor

from myowave.physics import joint as joint_physics
from myowave.physics import muscle as muscle_physics
from myowave.physics.constants import JOINT_CONSTANTS, MUSCLE_CONSTANTS
from myowave.physics.curves import Curves
from myowave.physics.effect import STAGES, Effect, Parameter, call
from myowave.physics.muscle import Muscle
from myowave.physics.path import Path, SideBySide, StraightPath

Params = Mapping[str, Tensor | float]


@dataclass(frozen=True)
class Model:
    """What moves the elbow. Its `name` is the model coordinate of the workflow, such as `base+joint_damping`."""

    muscles: tuple[Muscle, ...]
    joint: Mapping[str, float] = field(hash=False)
    curves: Curves = Curves()
    effects: tuple[Effect, ...] = ()

    def __post_init__(self) -> None:
        for effect in self.effects:
            if reason := self.refuses(effect):
                raise ValueError(f"effect {effect.name!r} {reason}")

    @property
    def name(self) -> str:
        return "+".join(("base", *(effect.name for effect in self.effects)))

    @cached_property
    def defaults(self) -> dict[str, float]:
        """Every parameter of the model with its nominal value; those of effects are 0."""
        muscles = {f"{c}_{m.name}": value for m in self.muscles for c, value in m.nominal.items()}
        return muscles | {c: float(self.joint[c]) for c in JOINT_CONSTANTS} | dict.fromkeys(self.effect_parameters, 0.0)

    @cached_property
    def effect_parameters(self) -> dict[str, Parameter]:
        """Parameters that the effects bring, by full name: `joint_damping.c`, or `emg_gain.g_Bi`, one per muscle."""
        return {name: p for effect in self.effects for name, p in self.parameters_of(effect).items()}

    def parameters_of(self, effect: Effect) -> dict[str, Parameter]:
        """Full names of an effect's parameters in this model."""
        return {full: effect.parameters[short] for short in effect.parameters for full in self.names(effect, short)}

    def names(self, effect: Effect, short: str) -> list[str]:
        """Full names of one of an effect's parameters: `joint_damping.c`, or one for each muscle."""
        stem = f"{effect.name}.{short}"
        return [f"{stem}_{m.name}" for m in self.muscles] if effect.parameters[short].per_muscle else [stem]

    @cached_property
    def stateful(self) -> tuple[Effect, ...]:
        """Effects with states of their own, those of activation first."""
        return tuple(e for stage in ("activation", "muscle") for e in self.on(stage) if e.stateful)

    @cached_property
    def common_constants(self) -> tuple[str, ...]:
        """Names of the constants that all muscles have; others belong to some muscles' kind of path."""
        return tuple(c for c in MUSCLE_CONSTANTS if all(c in m.nominal for m in self.muscles))

    def refuses(self, effect: Effect) -> str:
        """Why an effect cannot act on these muscles; empty where it can."""
        lacking = [c for c in MUSCLE_CONSTANTS if c in effect.asks and c not in self.common_constants]
        if not lacking:
            return ""
        without = next(m for m in self.muscles if lacking[0] not in m.nominal)
        return (
            f"needs {', '.join(lacking)}, which muscle {without.name} with a {without.path.kind} path does not have; "
            "leave the effect out, or give all muscles the path that it needs"
        )

    @property
    def state_size(self) -> int:
        """Numbers in a state vector: q, qdot, and one for each stateful effect and muscle."""
        return 2 + len(self.stateful) * len(self.muscles)

    def on(self, stage: str) -> tuple[Effect, ...]:
        """The effects that act on a stage, in the order they were added."""
        return self._by_stage[stage]

    @cached_property
    def _by_stage(self) -> dict[str, tuple[Effect, ...]]:
        return {stage: tuple(e for e in self.effects if e.acts_on == stage) for stage in STAGES}

    def check_names(self, names: Iterable[str]) -> None:
        """Raises a ValueError for names that are no parameters of the model."""
        if unknown := sorted(set(names) - set(self.defaults)):
            raise ValueError(
                f"model {self.name}: no parameter {', '.join(unknown)}; it has {', '.join(sorted(self.defaults))}"
            )

    def drives(self, name: str) -> bool:
        """Whether a parameter changes the drive of the muscles: their excitation, or their activation."""
        effect, dot, _ = name.partition(".")
        if dot:
            return next(e for e in self.effects if e.name == effect).drives
        return (MUSCLE_CONSTANTS | JOINT_CONSTANTS)[name.partition("_")[0]].drives

    @cached_property
    def early_activation(self) -> tuple[Effect, ...]:
        """Effects on the activation before the first one with a state: they belong to the muscles' drive."""
        return tuple(itertools.takewhile(lambda effect: not effect.stateful, self.on("activation")))

    @cached_property
    def late_activation(self) -> tuple[Effect, ...]:
        """Effects on the activation from the first one with a state on: they act step by step."""
        return self.on("activation")[len(self.early_activation) :]

    @cached_property
    def fibre_effects(self) -> tuple[Effect, ...]:
        """Effects on the stage `muscle` without a state: they change what a fibre does."""
        return tuple(e for e in self.on("muscle") if not e.stateful)

    @cached_property
    def tendon_effects(self) -> tuple[Effect, ...]:
        """Effects on the stage `muscle` with a state, such as a tendon's stretch."""
        return tuple(e for e in self.on("muscle") if e.stateful)

    def with_effects(self, effects: Iterable[Effect]) -> "Model":
        """The same muscles and joint with these effects added."""
        return replace(self, effects=(*self.effects, *effects))


def parse_model(name: str, base: Model, catalogue: Mapping[str, Effect]) -> Model:
    """The model that a coordinate such as `base+joint_damping+gravity_tilt` names.

    Raises:
        ValueError: for a name that does not start with `base`, an effect not in the catalogue, or one named twice.
    """
    first, *names = name.split("+")
    if first != "base":
        raise ValueError(f"model {name!r}: found {first!r} first; a model is written base, or base+effect+effect")
    if unknown := [n for n in names if n not in catalogue]:
        raise ValueError(f"model {name!r}: no effect {', '.join(unknown)}; the catalogue has {', '.join(catalogue)}")
    if len(set(names)) != len(names):
        raise ValueError(f"model {name!r}: names an effect twice; name each once")
    return base.with_effects(catalogue[n] for n in names)


@dataclass(frozen=True)
class Bound:
    """A model with values for all its parameters, stacked for arithmetic. Make it with `bind`.

    `muscle` values are (..., T, M), `joint` values (..., T), each with `axes` axes of length 1 put in after T. `path`
    holds the constants that only some muscles have, by full name, (..., T).
    """

    model: Model
    muscle: Mapping[str, Tensor]
    joint: Mapping[str, Tensor]
    path: Mapping[str, Tensor]
    effect: Mapping[str, Mapping[str, Tensor]]
    axes: int = 0

    def along(self, axes: int) -> "Bound":
        """The same values, broadcastable to quantities with `axes` more axes (time, points) after the trials."""
        assert self.axes == 0
        effect = {
            e.name: {n: _insert(v, axes, muscles=e.on_muscles(n)) for n, v in self.values(e).items()}
            for e in self.model.effects
        }
        return replace(
            self,
            muscle={n: _insert(v, axes, muscles=True) for n, v in self.muscle.items()},
            joint={n: _insert(v, axes, muscles=False) for n, v in self.joint.items()},
            path={n: _insert(v, axes, muscles=False) for n, v in self.path.items()},
            effect=effect,
            axes=axes,
        )

    def values(self, effect: Effect) -> Mapping[str, Tensor]:
        """The values of an effect's parameters, by their short names."""
        return self.effect[effect.name]

    @cached_property
    def driving(self) -> Mapping[str, Tensor]:
        """The side of the muscles and those of their constants that may change their drive."""
        return {n: v for n, v in self.muscle.items() if n == "side" or MUSCLE_CONSTANTS[n].drives}

    @cached_property
    def combined(self) -> "Combined":
        """Combinations of the constants that the equation of motion needs at every step."""
        c = self.muscle
        pennate = bool((c["pennation"] != 0).any())
        leaning = bool((self.joint["tilt"] != 0).any())
        hanging = {name: self.joint[name] for name in ("mass", "length", "load")}
        return Combined(
            path=self._paths(),
            height=c["l0"] * torch.sin(c["pennation"]) if pennate else None,
            inertia=joint_physics.inertia(**hanging),
            weight=joint_physics.weight(**hanging),
            tilt=self.joint["tilt"] if leaning else None,
        )

    def _paths(self) -> Path | SideBySide:
        c, muscles = self.muscle, self.model.muscles
        if all(isinstance(m.path, StraightPath) for m in muscles):
            return StraightPath(c["l1"], c["l2"], c["side"])

        def value(i: int, name: str) -> Tensor:
            return c[name][..., i] if name in c else self.path[f"{name}_{muscles[i].name}"]

        bound = (m.path.with_constants({n: value(i, n) for n in m.path.constants}) for i, m in enumerate(muscles))
        return SideBySide(tuple(bound))


@dataclass(frozen=True)
class Combined:
    """Combinations of constants: see `path`, `muscle.fibre_state` (height) and `joint` (moment of inertia, moment of
    the weight, tilt)."""

    path: Path | SideBySide
    height: Tensor | None
    inertia: Tensor
    weight: Tensor
    tilt: Tensor | None


def bind(model: Model, params: Params, like: Tensor) -> Bound:
    """Give values to a model's parameters; those not in `params` take their defaults.

    Args:
        params: name -> value, each a number or a tensor broadcastable to (..., T).
        like: a tensor whose dtype and device the values take.

    Raises:
        ValueError: for a name the model does not have.
    """
    model.check_names(params)
    full = {n: _value(params.get(n, default), like) for n, default in model.defaults.items()}
    muscle = {c: _stack([full[f"{c}_{m.name}"] for m in model.muscles]) for c in model.common_constants}
    path = {f"{c}_{m.name}": full[f"{c}_{m.name}"] for m in model.muscles for c in m.nominal if c not in muscle}
    muscle["side"] = torch.tensor([m.side for m in model.muscles], dtype=like.dtype, device=like.device)
    joint = {c: full[c] for c in JOINT_CONSTANTS}
    effect = {}
    for e in model.effects:
        values = {}
        for short in e.parameters:
            stacked = _stack([full[n] for n in model.names(e, short)])
            values[short] = stacked if e.on_muscles(short) else stacked.squeeze(-1)
        effect[e.name] = values
        if e.acts_on == "constants":
            changed = call(e.function, {**muscle, **joint}, values)
            if strange := sorted(set(changed) - set(muscle) - set(joint)):
                raise ValueError(
                    f"effect {e.name!r} returns values for {', '.join(strange)}, which are not constants; "
                    f"there are {', '.join((*model.common_constants, *JOINT_CONSTANTS))}."
                )
            muscle.update({n: v for n, v in changed.items() if n in muscle})
            joint.update({n: v for n, v in changed.items() if n in joint})
    return Bound(model, muscle, joint, path, effect)


def _value(value: Tensor | float, like: Tensor) -> Tensor:
    return torch.atleast_1d(torch.as_tensor(value, dtype=like.dtype, device=like.device))


def _stack(values: Sequence[Tensor]) -> Tensor:
    return torch.stack(torch.broadcast_tensors(*values), dim=-1)


def _insert(value: Tensor, axes: int, *, muscles: bool) -> Tensor:
    """Put `axes` axes of length 1 behind the trials; a bare (M,) vector broadcasts as it is."""
    shape = value.shape
    if not muscles:
        return value.reshape(*shape, *(1,) * axes)
    return value if len(shape) < 2 else value.reshape(*shape[:-1], *(1,) * axes, shape[-1])


@dataclass(frozen=True)
class Torques:
    """What turns the joint [N m], all of the shape of q; `total` is their sum. `inertia` in kg m^2."""

    muscles: Tensor
    gravity: Tensor
    effects: Tensor
    inertia: Tensor

    @property
    def total(self) -> Tensor:
        return self.muscles + self.gravity + self.effects


def muscle_quantities(bound: Bound, q: Tensor, qdot: Tensor, activation: Tensor) -> dict[str, Any]:
    """Path, fibre and force of every muscle at a joint state, before the effects that have a state.

    Args:
        q, qdot: joint angle and velocity [rad, rad/s], (...).
        activation: (..., M).

    Returns:
        The quantities of the stage `muscle` (see `effect`), plus `moment_arm` and `cosine` of the pennation angle.
    """
    model, c, combined = bound.model, bound.muscle, bound.combined
    # One muscle after the other in memory: element-wise work then runs along time, several times faster than along M.
    angle = q.expand(len(model.muscles), *q.shape).contiguous().movedim(0, -1)
    length, arm = combined.path.length_and_arm(angle)
    for effect in model.on("path"):
        quantities = {**c, "q": angle, "length_mt": length, "moment_arm": arm}
        length, arm = call(effect.function, quantities, bound.values(effect))
    velocity = -arm * qdot.unsqueeze(-1)
    fibre_length, fibre_velocity, cosine = muscle_physics.fibre_state(
        length, velocity, l0=c["l0"], vmax=c["vmax"], slack=c["slack"], height=combined.height
    )

    def hill(a: Tensor, length: Tensor, velocity: Tensor) -> Tensor:
        force = muscle_physics.hill_force(model.curves, a, length, velocity)
        for effect in model.fibre_effects:
            fibre = {"activation": a, "fibre_length": length, "fibre_velocity": velocity, "force": force}
            force = call(effect.function, {**c, **fibre, "curves": model.curves}, bound.values(effect))
        return force

    return {
        **c,
        "activation": activation,
        "fibre_length": fibre_length,
        "fibre_velocity": fibre_velocity,
        "curves": model.curves,
        "hill": hill,
        "force": hill(activation, fibre_length, fibre_velocity),
        "moment_arm": arm,
        "cosine": cosine,
    }


def torques(bound: Bound, q: Tensor, qdot: Tensor, activation: Tensor, states: Mapping[str, Tensor]) -> Torques:
    """All torques about the elbow at a state.

    Args:
        q, qdot: [rad, rad/s], (...).
        activation: (..., M).
        states: of the effects on the stage `muscle` that have one, by effect name, (..., M).

    Source: Taneja et al. 2023, Eqs. 54-59.
    """
    model = bound.model
    muscles = muscle_quantities(bound, q, qdot, activation)
    force = muscles["force"]
    for effect in model.tendon_effects:
        quantities = {**muscles, "force": force, "state": states[effect.name]}
        force = call(effect.function, quantities, bound.values(effect))
    pull = bound.muscle["f0"] * force * muscles["cosine"]
    muscle_torque = (pull * muscles["moment_arm"]).sum(-1)
    gravity = joint_physics.gravity_torque(q, bound.combined.weight, bound.combined.tilt)
    extra = torch.zeros_like(muscle_torque)
    for effect in model.on("joint"):
        quantities = {
            **bound.muscle,
            **bound.joint,
            "curves": model.curves,
            "q": q,
            "qdot": qdot,
            "activation": activation,
            "torque": muscle_torque,
        }
        extra = extra + call(effect.function, quantities, bound.values(effect))
    return Torques(muscle_torque, gravity, extra, moment_of_inertia(bound, q))


def moment_of_inertia(bound: Bound, q: Tensor) -> Tensor:
    """Moment of inertia about the elbow at an angle (...) [rad], with effects that act on it, broadcastable to (...)
    [kg m^2].

    Source: Taneja et al. 2023, Eq. 55.
    """
    inertia = bound.combined.inertia
    for effect in bound.model.on("inertia"):
        inertia = inertia + call(effect.function, {**bound.joint, "q": q}, bound.values(effect))
    return inertia


def acceleration(bound: Bound, q: Tensor, qdot: Tensor, activation: Tensor, states: Mapping[str, Tensor]) -> Tensor:
    """Angular acceleration [rad/s^2]; arguments as for `torques`. Source: Taneja et al. 2023, Eq. 54."""
    result = torques(bound, q, qdot, activation, states)
    return result.total / result.inertia


def observe(bound: Bound, q: Tensor, qdot: Tensor, dt: float) -> Tensor:
    """The angle that a sensor reports [rad] for a motion (..., T, N), through the effects on `observation`."""
    assert bound.axes == 1
    for effect in bound.model.on("observation"):
        q = call(effect.function, {"q": q, "qdot": qdot, "dt": dt}, bound.values(effect))
    return q
