"""The section `physics`: muscles, joint and curves. Units, meanings and bounds are those of the physics' constants."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from myowave.physics.constants import JOINT_CONSTANTS, MUSCLE_CONSTANTS, Constant, constants_of_path
from myowave.settings.section import Name, Real, Section, setting


def constant(constant: Constant, *, optional: bool = False) -> Any:
    """The key of a physical constant."""
    required = ... if constant.default is None else constant.default
    bounds: Mapping[str, Any] = constant.bounds
    return setting(constant.meaning, constant.unit, None if optional else required, **bounds)


class StraightPath(Section):
    """A straight line over the joint."""

    kind: Literal["straight"] = setting("straight: a line from the origin to the insertion")
    l1_m: Real = constant(MUSCLE_CONSTANTS["l1"])
    l2_m: Real = constant(MUSCLE_CONSTANTS["l2"])


class TablePath(Section):
    """A path given by its length at several angles; between these it is a cubic spline."""

    kind: Literal["table"] = setting("table: lengths of the muscle-tendon unit, at rising elbow angles")
    file: str = setting("CSV file with columns angle_deg or angle_rad and length_m", min_length=1)
    muscle: str | None = setting("whose rows to take, where the file has a column muscle", "", None)
    scale: Real = constant(MUSCLE_CONSTANTS["scale"])


class Muscle(Section):
    """A muscle group that crosses the elbow. Defaults are left to config.yaml: no value is right for any muscle."""

    side: Literal["flexor", "extensor"] = setting("side of the joint on which the muscle runs")
    emg: Annotated[str, Field(pattern=r"^emg_\w+$")] = setting("EMG channel that drives it: a column of the trials")
    f0_N: Real = constant(MUSCLE_CONSTANTS["f0"])
    l0_m: Real = constant(MUSCLE_CONSTANTS["l0"])
    vmax_m_s: Real = constant(MUSCLE_CONSTANTS["vmax"])
    slack_m: Real = constant(MUSCLE_CONSTANTS["slack"])
    pennation_rad: Real = constant(MUSCLE_CONSTANTS["pennation"])
    l1_m: Real | None = constant(MUSCLE_CONSTANTS["l1"], optional=True)
    l2_m: Real | None = constant(MUSCLE_CONSTANTS["l2"], optional=True)
    path: StraightPath | TablePath | None = setting(
        "path over the joint, instead of l1_m and l2_m", "", None, discriminator="kind"
    )
    delay_s: Real = constant(MUSCLE_CONSTANTS["delay"])
    shape_A: Real = constant(MUSCLE_CONSTANTS["shape"])

    @model_validator(mode="after")
    def _one_path(self) -> "Muscle":
        given = (self.l1_m is not None) + (self.l2_m is not None)
        if given != (0 if self.path else 2):
            raise ValueError("give l1_m and l2_m (a straight path), or a section path with kind: straight or table")
        return self

    @property
    def geometry(self) -> StraightPath | TablePath:
        """The path, also where l1_m and l2_m are written in short."""
        return self.path or StraightPath(kind="straight", l1_m=self.l1_m, l2_m=self.l2_m)


class Joint(Section):
    """The forearm: a point mass on a rigid rod."""

    mass_kg: Real = constant(JOINT_CONSTANTS["mass"])
    length_m: Real = constant(JOINT_CONSTANTS["length"])


class Curves(Section):
    """Which published muscle curves to use; their sources are in physics/curves.py."""

    active_length: Literal["taneja", "millard", "degroote"] = setting("active force-length", "", "taneja")
    passive: Literal["taneja", "millard", "degroote"] = setting("passive force-length", "", "taneja")
    force_velocity: Literal["thelen", "millard", "degroote"] = setting("force-velocity", "", "thelen")


class Physics(Section):
    """The musculoskeletal model that everything starts from."""

    muscles: dict[Name, Muscle] = setting("muscle groups, by short name", each="muscle", min_length=1)
    joint: Joint = setting("the forearm")
    curves: Curves = setting("muscle curves", default=Curves)
    effect_files: tuple[str, ...] = setting("Python files with effects of your own", default=())

    @property
    def files(self) -> tuple[str, ...]:
        """Files that the model is made of: effects of the user's own, and tables of paths."""
        paths = [muscle.path.file for muscle in self.muscles.values() if isinstance(muscle.path, TablePath)]
        return tuple(dict.fromkeys([*self.effect_files, *paths]))

    @property
    def parameters(self) -> set[str]:
        """Names of all physical constants: `f0_Bi`, ..., `mass`, `length`, `load`, `tilt`."""
        names = set(JOINT_CONSTANTS)
        for name, muscle in self.muscles.items():
            kinds = (*constants_of_path(""), *constants_of_path(muscle.geometry.kind))
            names |= {f"{kind}_{name}" for kind in kinds}
        return names
