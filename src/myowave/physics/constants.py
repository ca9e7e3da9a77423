"""The physical constants of a muscle and of the joint: the one list that the physics and the settings both read.

Nothing heavy is imported here: whoever checks a configuration reads this file without loading the physics.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Constant:
    """A physical constant.

    Args:
        unit: SI unit.
        meaning: one phrase for people.
        key: what the configuration calls it; empty where it is no key there.
        bounds: of the configuration's value, as pydantic calls them (gt, ge, lt, le).
        default: None where a model must give a value.
        path: kind of the muscle's path that it belongs to; empty where every muscle has it.
        drives: whether excitation or activation depends on it. Only such constants reach the functions that compute
            the drive of the muscles, so a constant that is wrongly declared fails there instead of giving derivatives
            that are wrong in silence.
    """

    unit: str
    meaning: str
    key: str = ""
    bounds: Mapping[str, float] = field(default_factory=dict, hash=False)
    default: float | None = None
    path: str = ""
    drives: bool = False


POSITIVE = {"gt": 0}

# The parameter of muscle `Bi` is called `f0_Bi`.
MUSCLE_CONSTANTS = {
    "f0": Constant("N", "maximum isometric force", "f0_N", POSITIVE),
    "l0": Constant("m", "optimal fibre length", "l0_m", POSITIVE),
    "vmax": Constant("m/s", "maximum contraction velocity", "vmax_m_s", POSITIVE),
    "slack": Constant("m", "tendon slack length", "slack_m", POSITIVE),
    "pennation": Constant(
        "rad", "pennation angle at optimal fibre length", "pennation_rad", {"ge": 0, "lt": 1.4}, default=0.0
    ),
    "l1": Constant("m", "distance of the origin from the joint", "l1_m", POSITIVE, path="straight"),
    "l2": Constant("m", "distance of the insertion from the joint", "l2_m", POSITIVE, path="straight"),
    "scale": Constant("-", "factor on the lengths of a table", "scale", POSITIVE, default=1.0, path="table"),
    "delay": Constant("s", "electromechanical delay", "delay_s", {"ge": 0, "le": 0.5}, default=0.08, drives=True),
    "shape": Constant(
        "-", "shape factor A of the activation, Eq. 2", "shape_A", {"ge": 0, "le": 3}, default=0.2, drives=True
    ),
}

JOINT_CONSTANTS = {
    "mass": Constant("kg", "forearm mass, at the wrist", "mass_kg", POSITIVE),
    "length": Constant("m", "forearm length", "length_m", POSITIVE),
    "load": Constant("kg", "known mass held in the hand", default=0.0),
    "tilt": Constant("rad", "known lean of the upper arm from the vertical, forward positive", default=0.0),
}


def constants_of_path(kind: str) -> tuple[str, ...]:
    """Names of the constants that belong to a kind of path; those that every muscle has for the empty kind."""
    return tuple(name for name, constant in MUSCLE_CONSTANTS.items() if constant.path == kind)


def constant_unit(name: str) -> str:
    """Unit of a constant of a muscle or of the joint, such as `f0_Bi` or `mass`."""
    return (MUSCLE_CONSTANTS | JOINT_CONSTANTS)[name.partition("_")[0]].unit
