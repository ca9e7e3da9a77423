"""The physical constants of a muscle, of a group and of the joint: the one list that physics and settings both read.

Nothing heavy is imported here: whoever checks a configuration reads this file without loading the physics.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Constant:
    """A physical constant."""

    unit: str  # SI unit
    meaning: str  # one phrase for people
    key: str = ""  # what the configuration calls it; empty where it is no key there
    # of any value that settings give it, as pydantic calls them (gt, ge, lt, le). They leave room for any arm and model
    # of one, and catch another unit.
    bounds: Mapping[str, float] = field(default_factory=dict, hash=False)
    default: float | None = None  # None where a model must give a value
    kind: str = ""  # of path or of forearm that it belongs to; empty where all muscles, or all forearms, have it
    # whether excitation or activation depends on it. Only such constants reach the functions that compute the drive of
    # the muscles, so a constant that is wrongly declared fails there instead of giving derivatives that are wrong in
    # silence.
    drives: bool = False
    scales: tuple[str, ...] = ()  # of a group's factor, the constants of its muscles that it multiplies


LATEST_S = 0.3  # a muscle is never later than that behind its EMG
DISTANCE = {"ge": 0.001, "le": 5}  # in mm it would be farther

# The parameter of muscle `Bi` is called `f0_Bi`.
MUSCLE_CONSTANTS = {
    "f0": Constant("N", "maximum isometric force", "f0_N", {"gt": 0, "le": 1e5}),
    "l0": Constant("m", "optimal fibre length", "l0_m", DISTANCE),
    "vmax": Constant("m/s", "maximum contraction velocity", "vmax_m_s", {"gt": 0, "le": 100}),
    "slack": Constant("m", "tendon slack length", "slack_m", DISTANCE),
    "pennation": Constant(
        "rad", "pennation angle at optimal fibre length", "pennation_rad", {"ge": 0, "lt": 1.4}, default=0.0
    ),
    "l1": Constant("m", "distance from the joint to the origin", "l1_m", DISTANCE, kind="straight"),
    "l2": Constant("m", "distance from the joint to the insertion", "l2_m", DISTANCE, kind="straight"),
    "scale": Constant("-", "factor on the lengths of a table", bounds={"gt": 0, "le": 10}, default=1.0, kind="table"),
    "delay": Constant("s", "electromechanical delay", "delay_s", {"ge": 0, "le": LATEST_S}, default=0.08, drives=True),
    "shape": Constant("-", "shape factor A of the activation", "shape_A", {"ge": 0, "le": 3}, default=0.2, drives=True),
}

# Factors, 1 by default, of the muscles that name a group: one number to estimate for all of them, `strength_flexors`.
# ASSUME: muscles of a group are stronger or longer than the model says by one factor. A length keeps the ratio of fibre
# to tendon, as scaling a model to a person does, and longer fibres shorten by as many of their lengths per second.
GROUP_CONSTANTS = {
    "strength": Constant(
        "-", "factor on the maximum isometric forces of a group", bounds={"gt": 0, "le": 100}, scales=("f0",)
    ),
    "length": Constant(
        "-",
        "factor on optimal fibre and tendon slack lengths of a group",
        bounds={"gt": 0, "le": 10},
        scales=("l0", "slack", "vmax"),
    ),
}

# Shapes of the muscle curves, 0 where the curves are as published; shared by all muscles of an arm: `descending_curve`.
CURVE = "curve"
_CURVE_MEANINGS = {
    "ascending": "relative widening of the active force-length curve below the optimal length",
    "descending": "relative widening of the active force-length curve above the optimal length",
    "rising": "logarithm of the power that the active force is raised to below the optimal length",
    "falling": "logarithm of the power that the active force is raised to above the optimal length",
    "sagging": "logarithm of the power that the force when shortening is raised to",
    "concentric": "logarithm of the factor on the bend of the shortening force-velocity curve",
    "yielding": "logarithm of the factor on the slope where lengthening begins",
    "eccentric": "relative change of the most that lengthening adds to the force",
    "passive": "logarithm of the factor on the passive force",
    "stiffening": "logarithm of the factor on how steeply the passive force rises, the same at 1.3 optimal lengths",
    "onset": "shift of the passive curve towards longer fibres, in optimal lengths",
}
_RELATIVE = ("ascending", "descending", "eccentric")
CURVE_CONSTANTS = {
    name: Constant("-", meaning, bounds={"gt": -1} if name in _RELATIVE else {}, default=0.0)
    for name, meaning in _CURVE_MEANINGS.items()
}

JOINT_CONSTANTS = {
    "mass": Constant("kg", "forearm mass", "mass_kg", {"gt": 0, "le": 100}),
    "length": Constant(
        "m", "distance of all mass from the elbow, a point at the wrist", "length_m", DISTANCE, kind="point"
    ),
    "com": Constant("m", "distance of the forearm's centre of mass from the elbow", "com_m", DISTANCE, kind="body"),
    "inertia": Constant(
        "kg m^2", "moment of inertia about the elbow", "inertia_kg_m2", {"gt": 0, "le": 100}, kind="body"
    ),
    "grip": Constant("m", "distance of what the hand holds from the elbow", "grip_m", DISTANCE, kind="body"),
    "load": Constant("kg", "known mass held in the hand", bounds={"ge": 0, "le": 200}, default=0.0),
    "tilt": Constant(
        "rad",
        "known tilt of the upper arm from the vertical, forward positive",
        bounds={"ge": -math.pi, "le": math.pi},
        default=0.0,
    ),
    "motor": Constant("N m", "known torque of a motor with the joint at rest, flexing positive", default=0.0),
    "braking": Constant(
        "N m s/rad", "what it falls by with speed: the back EMF, kt^2 / R", bounds={"ge": 0, "le": 1e4}, default=0.0
    ),
    "drive": Constant(
        "-", "factor on a motor's torque and back EMF, as of warm windings", bounds={"gt": 0, "le": 10}, default=1.0
    ),
}
OVER_TIME = ("tilt", "motor")
"""Constants of the joint that may be known over time; what is known of them for a trial is then their median."""


def names_of(constants: Mapping[str, Constant], *kinds: str) -> tuple[str, ...]:
    """Names of the constants that belong to some kinds; the empty kind stands for those that all have."""
    return tuple(name for name, constant in constants.items() if constant.kind in kinds)


def values_of(constants: Mapping[str, Constant], given: object, *kinds: str) -> dict[str, float]:
    """Values of the constants of some kinds: what `given` has under their keys, or the default of one without a key."""
    named = {name: constants[name] for name in names_of(constants, *kinds)}
    return {name: getattr(given, c.key) if c.key else c.default or 0.0 for name, c in named.items()}


def nominal_of(
    muscles: Mapping[str, Mapping[str, float]], groups: Iterable[str], joint: Mapping[str, float]
) -> dict[str, float]:
    """Value of each constant of an arm by its full name, see `constant_of`, from those of its muscles by their names
    and those of its joint."""
    of_muscles = {f"{c}_{name}": value for name, own in muscles.items() for c, value in own.items()}
    of_groups = {f"{factor}_{group}": 1.0 for group in groups for factor in GROUP_CONSTANTS}
    curves = {f"{name}_{CURVE}": c.default or 0.0 for name, c in CURVE_CONSTANTS.items() if muscles}
    return of_muscles | of_groups | curves | dict(joint)


def constant_of(name: str) -> Constant:
    """A constant by its full name: of a muscle (`f0_Bi`), of a group (`strength_flexors`), of the muscle curves
    (`onset_curve`) or of the joint (`mass`)."""
    kind, _, owner = name.partition("_")
    if owner == CURVE and kind in CURVE_CONSTANTS:
        return CURVE_CONSTANTS[kind]
    return (MUSCLE_CONSTANTS | GROUP_CONSTANTS if owner else JOINT_CONSTANTS)[kind]
