"""The physical constants of a muscle and of the joint: unit, meaning, and whether they change the drive of the muscles.

Nothing heavy is imported here: whoever checks a configuration reads this file without loading the physics.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Constant:
    """A physical constant.

    Args:
        unit: SI unit.
        meaning: one phrase for people.
        drives: whether excitation or activation depends on it. Only such constants reach the functions that compute
            the drive of the muscles, so a constant that is wrongly declared fails there instead of giving derivatives
            that are wrong in silence.
    """

    unit: str
    meaning: str
    drives: bool = False


# The parameter of muscle `Bi` is called `f0_Bi`.
MUSCLE_CONSTANTS = {
    "f0": Constant("N", "maximum isometric force"),
    "l0": Constant("m", "optimal fibre length"),
    "vmax": Constant("m/s", "maximum contraction velocity"),
    "slack": Constant("m", "tendon slack length"),
    "pennation": Constant("rad", "pennation angle at optimal fibre length"),
    "l1": Constant("m", "distance of the origin from the joint"),
    "l2": Constant("m", "distance of the insertion from the joint"),
    "delay": Constant("s", "electromechanical delay", drives=True),
    "shape": Constant("-", "shape factor A of the activation, Eq. 2", drives=True),
}

JOINT_CONSTANTS = {
    "mass": Constant("kg", "forearm mass, at the wrist"),
    "length": Constant("m", "forearm length"),
    "load": Constant("kg", "known mass held in the hand"),
    "tilt": Constant("rad", "known lean of the upper arm from the vertical, forward positive"),
}


def constant_unit(name: str) -> str:
    """Unit of a constant of a muscle or of the joint, such as `f0_Bi` or `mass`."""
    return (MUSCLE_CONSTANTS | JOINT_CONSTANTS)[name.partition("_")[0]].unit
