"""A model of the elbow: muscles + joint + effects, and the names and nominal values of its parameters."""

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from torch import Tensor

from myowave.physics.constants import JOINT_CONSTANTS, MUSCLE_CONSTANTS, constant_of, nominal_of
from myowave.physics.curves import Curves
from myowave.physics.effect import DRIVE_STAGES, STAGES, Effect, Parameter
from myowave.physics.joint import kind_of_forearm
from myowave.physics.muscle import Muscle

Params = Mapping[str, Tensor | float]


@dataclass(frozen=True)
class Model:
    """What moves the elbow. Its `name` is the model coordinate of the workflow, such as `base+joint_damping`."""

    muscles: tuple[Muscle, ...]
    joint: Mapping[str, float] = field(hash=False)
    curves: Curves = Curves()
    effects: tuple[Effect, ...] = ()

    def __post_init__(self) -> None:
        absent = {name: c.default for name, c in JOINT_CONSTANTS.items() if c.default is not None}
        object.__setattr__(self, "joint", absent | dict(self.joint))
        for effect in self.effects:
            if reason := self.refuses(effect):
                raise ValueError(f"effect {effect.name!r} {reason}")

    @property
    def name(self) -> str:
        return "+".join(("base", *(effect.name for effect in self.effects)))

    @cached_property
    def defaults(self) -> dict[str, float]:
        """Every parameter of the model with its nominal value; those of effects are 0."""
        joint = {name: float(value) for name, value in self.joint.items()}
        constants = nominal_of({m.name: m.nominal for m in self.muscles}, self.groups, joint)
        return constants | dict.fromkeys(self.effect_parameters, 0.0)

    @cached_property
    def groups(self) -> tuple[str, ...]:
        """Groups that the muscles name, each once."""
        return tuple(dict.fromkeys(m.group for m in self.muscles if m.group))

    @cached_property
    def channels(self) -> tuple[str, ...]:
        """EMG channels that drive the muscles, each once."""
        return tuple(dict.fromkeys(m.channel for m in self.muscles))

    @cached_property
    def electrodes(self) -> tuple[int, ...]:
        """Place of each muscle's EMG among the channels."""
        return tuple(self.channels.index(m.channel) for m in self.muscles)

    @cached_property
    def leading(self) -> dict[str, Muscle]:
        """The first muscle of each channel: muscles that share one are taken to be alike."""
        return {c: next(m for m in self.muscles if m.channel == c) for c in self.channels}

    @cached_property
    def effect_parameters(self) -> dict[str, Parameter]:
        """Parameters that the effects bring, by full name: `joint_damping.c`, or some per muscle or electrode."""
        return {name: p for effect in self.effects for name, p in self.parameters_of(effect).items()}

    def parameters_of(self, effect: Effect) -> dict[str, Parameter]:
        """Full names of an effect's parameters in this model."""
        return {full: effect.parameters[short] for short in effect.parameters for full in self.names(effect, short)}

    def names(self, effect: Effect, short: str) -> list[str]:
        """Full names of one of an effect's parameters: `joint_damping.c`, or one for each muscle, its own
        (`moment_arm_offset.d_Bi`) or its electrode's (`emg_gain.g_emg_biceps`)."""
        stem, each = f"{effect.name}.{short}", effect.parameters[short].each
        if each is None:
            return [stem]
        return [f"{stem}_{m.name if each == 'muscle' else m.channel}" for m in self.muscles]

    @cached_property
    def stateful(self) -> tuple[Effect, ...]:
        """Effects with states of their own, those of activation first."""
        return tuple(e for place in ("late_activation", "tendon") for e in self.places[place] if e.stateful)

    @cached_property
    def common_constants(self) -> tuple[str, ...]:
        """Names of the constants that all muscles have; others belong to some muscles' kind of path."""
        return tuple(c for c in MUSCLE_CONSTANTS if all(c in m.nominal for m in self.muscles))

    def refuses(self, effect: Effect) -> str:
        """Why an effect cannot act on these muscles; empty where it can."""
        if effect.needs_muscles and not self.muscles:
            return "acts on muscles, and the arm has none; leave the effect out"
        lacking = sorted(effect.constants - set(self.common_constants) - set(self.joint))
        if not lacking:
            return ""
        if lacking[0] in JOINT_CONSTANTS:
            kind = kind_of_forearm(self.joint)
            return f"needs {', '.join(lacking)}, which a forearm of kind {kind} does not have; leave the effect out"
        without = next(m for m in self.muscles if lacking[0] not in m.nominal)
        return (
            f"needs {', '.join(lacking)}, which muscle {without.name} with a {without.path.kind} path does not have; "
            "leave the effect out, or give all muscles the path that it needs"
        )

    @property
    def state_size(self) -> int:
        """Numbers in a state vector: q, qdot, and one for each stateful effect and muscle."""
        return 2 + len(self.stateful) * len(self.muscles)

    @cached_property
    def places(self) -> Mapping[str, tuple[Effect, ...]]:
        """The effects by where they act, in the order they were added: at a stage, two of which have a part without
        states and one with them.

        Effects on the activation before the first one with a state (`early_activation`) belong to the muscles' drive;
        from that one on (`late_activation`) they act step by step. Those on the stage `muscle` without a state change
        what a fibre does (`fibre`), the others what its tendon passes on (`tendon`).
        """
        on = {stage: tuple(e for e in self.effects if e.acts_on == stage) for stage in STAGES}
        activation, muscle = on.pop("activation"), on.pop("muscle")
        early = tuple(itertools.takewhile(lambda effect: not effect.stateful, activation))
        return on | {
            "early_activation": early,
            "late_activation": activation[len(early) :],
            "fibre": tuple(e for e in muscle if not e.stateful),
            "tendon": tuple(e for e in muscle if e.stateful),
        }

    def drives(self, name: str) -> bool:
        """Whether a parameter changes the drive of the muscles: their excitation, or their activation."""
        effect, dot, _ = name.partition(".")
        if dot:
            return next(e for e in self.effects if e.name == effect).acts_on in DRIVE_STAGES
        return constant_of(name).drives

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
