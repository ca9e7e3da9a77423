"""What a physical effect is: one equation that the base model lacks, at the stage where it acts.

An effect's `function` takes *quantities* as ordinary arguments, by the names below, and its own *parameters* as
keyword-only arguments. It returns what its stage names. With all parameters at 0 it must change nothing.

    stage         function returns                              quantities it may ask for
    constants     {constant: new value}                         every constant (f0, l0, ..., mass, ..., load, tilt)
    excitation    u, muscles on the last axis (..., M)          excitation, side
    activation    a (..., M)                                    excitation, activation, side [, state]
    path          (length [m], moment arm [m]) (..., M)         q, length_mt, moment_arm, constants of the muscles
    muscle        force in units of f0 (..., M)                 force, base_force, activation, fibre_length,
                                                                fibre_velocity, curves, constants of the muscles
                                                                [, state, hill]
    inertia       extra moment of inertia [kg m^2] (...)        q, inertia, weight, constants of the joint
    joint         extra torque [N m] (...)                      q, qdot, activation (..., M), torque, gravity, curves,
                                                                inertia, weight, constants
    observation   measured angle [rad] (..., N)                 q, qdot, dt, begin

`side` (M,) is +1 for flexors and -1 for extensors, and counts among the constants of the muscles; `curves` are the
base model's muscle curves, and `base_force` is what they give; `torque` is that of all that drives the joint, muscles
and a motor, `gravity` that of the weight. Constants of a kind of path (l1 and l2 of a straight one, scale of a table)
are there only if all muscles have such a path, and `length`, or `com` and `grip`, only if the model's forearm has them;
`inertia` of the forearm about the elbow, without load, and the moment `weight` of all that hangs from the elbow, with
the forearm level, are there for any. `begin` (..., 1) is when the first sample is, after its trial began [s].

At the stages `activation` and `muscle` an effect may have a state y of its own, one number per muscle, that relaxes:
dy/dt = (target - y) / time constant. Then `relaxation` returns (target, time constant [s] where y rises, where it
falls) from the same quantities; a time constant of 0 keeps y at its target. `initial` returns y at the first sample,
0 where it is left out. Effects without a state on the stage `muscle` change what a fibre does, before those with one:
these see the changed fibre as `hill(activation, fibre_length, fibre_velocity)`, its force at any other state.
"""

import functools
import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, Literal

import torch
from torch import Tensor

from myowave.physics.constants import JOINT_CONSTANTS, MUSCLE_CONSTANTS

_MUSCLE = frozenset(MUSCLE_CONSTANTS) | {"side"}
_JOINT = frozenset(JOINT_CONSTANTS)
_FOREARM = frozenset({"inertia", "weight"})  # of any kind of forearm, at the stages of the joint

QUANTITIES: dict[str, frozenset[str]] = {
    "constants": frozenset(MUSCLE_CONSTANTS) | _JOINT,
    "excitation": frozenset({"excitation", "side"}),
    "activation": frozenset({"excitation", "activation", "side"}),
    "path": frozenset({"q", "length_mt", "moment_arm"}) | _MUSCLE,
    "muscle": frozenset({"force", "base_force", "activation", "fibre_length", "fibre_velocity", "curves"}) | _MUSCLE,
    "inertia": frozenset({"q"}) | _JOINT | _FOREARM,
    "joint": frozenset({"q", "qdot", "activation", "torque", "gravity", "curves"}) | _JOINT | _FOREARM | _MUSCLE,
    "observation": frozenset({"q", "qdot", "dt", "begin"}),
}
STAGES = tuple(QUANTITIES)
# Stages whose effects may have a state, and what these may ask for besides.
STATEFUL_STAGES = {"activation": frozenset({"state"}), "muscle": frozenset({"state", "hill"})}
MUSCLE_STAGES = ("excitation", "activation", "path", "muscle")  # quantities there have muscles on the last axis
# Stages before the force of the muscles: parameters there change the muscles' drive. An effect on the constants may
# change any of them, so it counts among these.
DRIVE_STAGES = ("constants", "excitation", "activation")


@dataclass(frozen=True)
class Parameter:
    """A number an effect brings, 0 where the effect is absent.

    Args:
        unit: SI unit.
        low, high: physical bounds.
        typical: a strength of practical interest, of either sign; scales steps and studies.
        meaning: one phrase for people.
        each: `muscle` for a value of each muscle, `electrode` for one of all muscles that share it, instead of one for
            all.
        alone: whether it acts while the effect's other parameters are 0, as the speed of a friction does not.
    """

    unit: str
    _: KW_ONLY
    low: float = 0.0
    high: float
    typical: float
    meaning: str
    each: Literal["muscle", "electrode"] | None = None
    alone: bool = True

    def __post_init__(self) -> None:
        if not (math.isfinite(self.low) and math.isfinite(self.high)):
            raise ValueError(f"bounds [{self.low}, {self.high}] must be finite; give the widest that is physical")
        if not (self.low <= 0.0 <= self.high and self.low < self.high):
            raise ValueError(f"bounds [{self.low}, {self.high}] must hold 0, which means no effect")
        if not (self.low <= self.typical <= self.high and self.typical != 0.0):
            raise ValueError(f"typical value {self.typical} must be within [{self.low}, {self.high}] and not 0")


@dataclass(frozen=True)
class Effect:
    """A physical effect that a model may have or lack; see the module's table for `acts_on` and `function`.

    Args:
        title: what it is in a few words, for people; the name's words where it is left out.
        replaces: whether it is usually there as a whole, as a family of curves is: its usual strength is its largest.

    Raises:
        ValueError: if the functions ask for quantities the stage does not have, or for other parameters than declared.
    """

    name: str
    acts_on: str
    equation: str
    function: Callable[..., Any]
    parameters: Mapping[str, Parameter] = field(hash=False)
    source: str
    relaxation: Callable[..., tuple[Tensor, Tensor, Tensor]] | None = None
    initial: Callable[..., Tensor] | None = None
    title: str = ""
    replaces: bool = False

    def __post_init__(self) -> None:
        where = f"effect {self.name!r}"
        if not (self.name.isidentifier() and self.name.isascii()):
            raise ValueError(f"{where}: the name must be a Python identifier of ASCII letters, such as joint_damping")
        if self.acts_on not in QUANTITIES:
            raise ValueError(f"{where}: acts_on is {self.acts_on!r}; expected one of {', '.join(STAGES)}")
        if not self.parameters:
            raise ValueError(f"{where}: declares no parameters; an effect needs at least one, 0 where it is absent")
        if self.stateful and self.acts_on not in STATEFUL_STAGES:
            raise ValueError(f"{where}: only effects on {' or '.join(STATEFUL_STAGES)} may have a relaxation")
        if self.initial is not None and not self.stateful:
            raise ValueError(f"{where}: has an initial state but no relaxation")
        object.__setattr__(self, "title", self.title or self.name.replace("_", " "))
        self._check_signature("function", self.function, needs_all=not self.stateful)
        if self.acts_on == "constants" and self.asks & set(MUSCLE_CONSTANTS) and self.asks & set(JOINT_CONSTANTS):
            raise ValueError(f"{where}: asks for constants of muscles and of the joint; write two effects")
        if self.relaxation is not None:
            self._check_signature("relaxation", self.relaxation, needs_all=False)
            if self.initial is not None:
                self._check_signature("initial", self.initial, needs_all=False)
            named = _names_of(self.function)[1] | _names_of(self.relaxation)[1]
            if missing := set(self.parameters) - named:
                raise ValueError(f"{where}: declares {sorted(missing)}, which neither function nor relaxation takes")

    @property
    def stateful(self) -> bool:
        """Whether the effect has a state of its own, one number per muscle."""
        return self.relaxation is not None

    @property
    def constants(self) -> frozenset[str]:
        """Constants that a model must have for the effect to act on it."""
        given = _FOREARM if self.acts_on in ("inertia", "joint") else frozenset()
        return (self.asks - given) & (set(MUSCLE_CONSTANTS) | set(JOINT_CONSTANTS))

    @property
    def needs_muscles(self) -> bool:
        """Whether the effect does nothing to an arm without muscles."""
        of_muscles = _MUSCLE | {"curves"}
        return (
            self.acts_on in MUSCLE_STAGES
            or bool(self.asks & of_muscles)
            or all(parameter.each for parameter in self.parameters.values())
        )

    @property
    def asks(self) -> frozenset[str]:
        """The quantities that the effect's functions ask for."""
        functions = (self.function, self.relaxation, self.initial)
        return frozenset().union(*(_names_of(f)[0] for f in functions if f is not None))

    def on_muscles(self, parameter: str) -> bool:
        """Whether a parameter's values have an axis for muscles: (..., M) or (..., 1), not (...)."""
        on_constants = self.acts_on == "constants" and bool(self.asks & set(MUSCLE_CONSTANTS))
        return self.acts_on in MUSCLE_STAGES or on_constants or self.parameters[parameter].each is not None

    def _check_signature(self, label: str, function: Callable[..., Any], *, needs_all: bool) -> None:
        where = f"effect {self.name!r}: {label}({', '.join(inspect.signature(function).parameters)})"
        known = QUANTITIES[self.acts_on] | (STATEFUL_STAGES[self.acts_on] if self.stateful else set())
        asked, taken = _names_of(function)
        if strange := asked - known:
            raise ValueError(
                f"{where} asks for {sorted(strange)}, which the stage {self.acts_on!r} does not have; "
                f"it has {', '.join(sorted(known))}. Parameters of the effect go after a bare `*`."
            )
        declared = set(self.parameters)
        if taken - declared or (needs_all and declared - taken):
            raise ValueError(
                f"{where} takes the parameters {sorted(taken)}, but the effect declares {sorted(declared)}; "
                "make the keyword-only arguments and `parameters` the same."
            )


def call(function: Callable[..., Any], quantities: Mapping[str, Any], parameters: Mapping[str, Tensor]) -> Any:
    """Call an effect's function with the quantities and parameters its signature names."""
    asked, taken = _names_of(function)
    return function(**{n: quantities[n] for n in asked}, **{n: parameters[n] for n in taken})


@dataclass(frozen=True)
class Acting:
    """An effect with the values of its parameters, as functions of the quantities alone."""

    effect: Effect
    values: Mapping[str, Tensor]

    def __call__(self, quantities: Mapping[str, Any]) -> Any:
        """What the effect's stage names."""
        return call(self.effect.function, quantities, self.values)

    def relaxation(self, quantities: Mapping[str, Any]) -> tuple[Tensor, Tensor, Tensor]:
        """Target and time constants of its state."""
        assert self.effect.relaxation is not None
        target, rise, fall = call(self.effect.relaxation, quantities, self.values)
        return target, rise, fall

    def initial(self, quantities: Mapping[str, Any], like: Tensor) -> Tensor:
        """Its state at the first sample, of the shape of `like`."""
        if self.effect.initial is None:
            return torch.zeros_like(like)
        return torch.broadcast_tensors(call(self.effect.initial, quantities, self.values), like)[0]


@functools.cache
def _names_of(function: Callable[..., Any]) -> tuple[frozenset[str], frozenset[str]]:
    """Names of the quantities and of the parameters that a function's signature asks for."""
    items = inspect.signature(function).parameters.values()
    parameters = frozenset(p.name for p in items if p.kind is p.KEYWORD_ONLY)
    return frozenset(p.name for p in items) - parameters, parameters
