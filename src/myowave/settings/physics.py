"""The section `physics`: arms, each with muscles, joint and curves.

Units, meanings and bounds are those of the physics' constants.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from myowave.physics.constants import JOINT_CONSTANTS, MUSCLE_CONSTANTS, Constant, nominal_of, values_of
from myowave.settings.files import lay_over, read_yaml
from myowave.settings.section import Name, Once, OneFile, Real, Section, WithoutNull, setting

PRESETS = Path("data")  # folder of the arms that ship, each in one of its own


def constant(constant: Constant, *, optional: bool = False) -> Any:
    """The key of a physical constant."""
    required = ... if constant.default is None else constant.default
    bounds: Mapping[str, Any] = constant.bounds
    return setting(constant.meaning, constant.unit, None if optional else required, **bounds)


class PathTable(Section):
    """A path given by the length of the muscle-tendon unit at rising elbow angles; between these, a cubic spline."""

    file: OneFile = setting("CSV file with columns angle_deg or angle_rad and length_m", min_length=1)
    muscle: str | None = setting("whose rows to take, where the file has a column muscle", "", None)
    margin_deg: Real = setting(
        "how far measured angles may be beyond the table, where the moment arm stays as at its end", "deg", 5.0, ge=0
    )


class MuscleSettings(Section):
    """A muscle group that crosses the elbow. Defaults are left to config.yaml: no value is right for any muscle."""

    side: Literal["flexor", "extensor"] = setting("side of the joint on which the muscle runs")
    emg: Annotated[str, Field(pattern=r"^emg_\w+$")] = setting("EMG channel that drives it: a column of the trials")
    group: Name | None = setting(
        "muscles of a group share the factors strength_GROUP and length_GROUP, which can be identified", default=None
    )
    f0_N: Real = constant(MUSCLE_CONSTANTS["f0"])
    l0_m: Real = constant(MUSCLE_CONSTANTS["l0"])
    vmax_m_s: Real = constant(MUSCLE_CONSTANTS["vmax"])
    slack_m: Real = constant(MUSCLE_CONSTANTS["slack"])
    pennation_rad: Real = constant(MUSCLE_CONSTANTS["pennation"])
    l1_m: Real | None = constant(MUSCLE_CONSTANTS["l1"], optional=True)
    l2_m: Real | None = constant(MUSCLE_CONSTANTS["l2"], optional=True)
    path: PathTable | None = setting("table of the path over the joint, instead of l1_m and l2_m", default=None)
    delay_s: Real = constant(MUSCLE_CONSTANTS["delay"])
    shape_A: Real = constant(MUSCLE_CONSTANTS["shape"])

    @model_validator(mode="after")
    def _one_path(self) -> "MuscleSettings":
        given = (self.l1_m is not None) + (self.l2_m is not None)
        if given != (0 if self.path else 2):
            raise ValueError("give l1_m and l2_m (a straight path), or a section path with the file of a table")
        return self

    @property
    def kind(self) -> Literal["straight", "table"]:
        return "table" if self.path else "straight"


class JointSettings(Section):
    """The forearm: a point mass on a rigid rod, or a rigid body."""

    mass_kg: Real = constant(JOINT_CONSTANTS["mass"])
    length_m: Real | None = constant(JOINT_CONSTANTS["length"], optional=True)
    com_m: Real | None = constant(JOINT_CONSTANTS["com"], optional=True)
    inertia_kg_m2: Real | None = constant(JOINT_CONSTANTS["inertia"], optional=True)
    grip_m: Real | None = constant(JOINT_CONSTANTS["grip"], optional=True)

    @model_validator(mode="after")
    def _one_kind(self) -> "JointSettings":
        body = (self.com_m, self.inertia_kg_m2, self.grip_m)
        if sum(value is not None for value in body) != (3 if self.length_m is None else 0):
            raise ValueError("give length_m (a point mass), or com_m, inertia_kg_m2 and grip_m (a rigid body)")
        if self.com_m is None or self.inertia_kg_m2 is None:
            return self
        if self.inertia_kg_m2 < (least := self.mass_kg * self.com_m**2):
            raise ValueError(
                f"inertia_kg_m2 is {self.inertia_kg_m2:g}, but about the elbow it is at least mass com^2 = {least:g}; "
                "add that to the inertia about the centre of mass"
            )
        return self

    @property
    def kind(self) -> Literal["point", "body"]:
        """Which constants describe the forearm."""
        return "body" if self.length_m is None else "point"


class CurveSettings(Section):
    """Which published muscle curves to use; their sources are in physics/curves.py."""

    active_length: Literal["taneja", "millard", "degroote", "thelen"] = setting("active force-length", "", "taneja")
    passive: Literal["taneja", "millard", "degroote", "thelen"] = setting("passive force-length", "", "taneja")
    force_velocity: Literal["hill", "millard", "degroote", "thelen"] = setting(
        "force-velocity; with thelen, v_max falls with the activation", "", "hill"
    )


class Arm(Section):
    """Muscles, forearm and curves of one arm: written out, or a preset with what differs from it."""

    preset: Name | None = setting(
        "arm that ships: what data/PRESET/PRESET.yaml says holds where nothing else is said here; null once it is read",
        default=None,
    )
    muscles: Annotated[dict[Name, MuscleSettings], WithoutNull] = setting(
        "muscle groups, by short name; {} for a limb or machine that a known torque drives, or nothing", each="muscle"
    )
    joint: JointSettings = setting("the forearm")
    curves: CurveSettings = setting("muscle curves", default=CurveSettings)

    @model_validator(mode="before")
    @classmethod
    def _over_preset(cls, value: Any) -> Any:
        if not isinstance(value, Mapping) or not isinstance(value.get("preset"), str):
            return value
        return lay_over(read_preset(value["preset"]), {k: v for k, v in value.items() if k != "preset"})

    @property
    def groups(self) -> tuple[str, ...]:
        """Groups that muscles name, each once."""
        return tuple(dict.fromkeys(muscle.group for muscle in self.muscles.values() if muscle.group))

    @property
    def channels(self) -> tuple[str, ...]:
        """EMG channels that drive the muscles, each once."""
        return tuple(dict.fromkeys(muscle.emg for muscle in self.muscles.values()))

    @property
    def sides(self) -> dict[str, int]:
        """EMG channels with the side of the muscles that each drives: 1 for flexors, -1 for extensors, 0 for both."""
        of = {c: {muscle.side for muscle in self.muscles.values() if muscle.emg == c} for c in self.channels}
        return {c: (len(sides) == 1) * (1 if "flexor" in sides else -1) for c, sides in of.items()}

    @property
    def tables(self) -> dict[str, PathTable]:
        """The paths that are given by a table, by muscle."""
        return {name: muscle.path for name, muscle in self.muscles.items() if muscle.path}

    @property
    def table_files(self) -> tuple[str, ...]:
        """Files of these tables, each once."""
        return tuple(dict.fromkeys(path.file for path in self.tables.values()))

    @property
    def nominal(self) -> dict[str, float]:
        """Value of each physical constant [SI]: `f0_Bi`, `strength_flexors`, `onset_curve`, `mass` and so on."""
        muscles = {name: values_of(MUSCLE_CONSTANTS, m, "", m.kind) for name, m in self.muscles.items()}
        return nominal_of(muscles, self.groups, values_of(JOINT_CONSTANTS, self.joint, "", self.joint.kind))


def read_preset(name: str) -> dict[str, Any]:
    """The sections of an arm that ships; one may be another with what differs from it. A ValueError if there is none of
    that name, or its file is not YAML."""
    path = PRESETS / name / f"{name}.yaml"
    if not path.is_file():
        there = sorted(file.stem for file in PRESETS.glob("*/*.yaml") if file.stem == file.parent.name)
        raise ValueError(f"there is no preset {name!r}: {path} is no file. Presets here: {', '.join(there) or 'none'}.")
    sections = read_yaml(path, "muscles and joint")
    below = sections.pop("preset", None)
    return sections if below is None else lay_over(read_preset(below), sections)


class Physics(Arm):
    """One arm and the effects of the user's own: all that a model is built of."""

    effect_files: tuple[OneFile, ...] = setting("Python files with effects of your own", default=())

    @property
    def files(self) -> tuple[str, ...]:
        """Files that the model is made of: effects of the user's own, and tables of paths."""
        return tuple(dict.fromkeys([*self.effect_files, *self.table_files]))


class Arms(Section):
    """The arms that datasets may name, and effects for all of them."""

    arms: dict[Name, Arm] = setting("arms, by the name that a dataset gives", each="arm", min_length=1)
    effect_files: Annotated[tuple[OneFile, ...], Once] = setting("Python files with effects of your own", default=())

    def of_arm(self, name: str) -> Physics:
        """One of the arms with the effects. It changes only with what concerns that arm."""
        own = {key: getattr(self.arms[name], key) for key in Arm.model_fields}
        return Physics.model_construct(**own, effect_files=self.effect_files)
