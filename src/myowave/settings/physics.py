"""The section `physics`: muscles, joint and curves."""

from typing import Annotated, Literal

from pydantic import Field

from myowave.settings.section import Name, Real, Section, setting


class Muscle(Section):
    """A muscle group that crosses the elbow. Defaults are left to config.yaml: no value is right for any muscle."""

    side: Literal["flexor", "extensor"] = setting("side of the joint on which the muscle runs")
    emg: Annotated[str, Field(pattern=r"^emg_\w+$")] = setting("EMG channel that drives it: a column of the trials")
    f0_N: Real = setting("maximum isometric force", "N", gt=0)
    l0_m: Real = setting("optimal fibre length", "m", gt=0)
    vmax_m_s: Real = setting("maximum contraction velocity", "m/s", gt=0)
    slack_m: Real = setting("tendon slack length", "m", gt=0)
    pennation_rad: Real = setting("pennation angle at optimal fibre length", "rad", 0.0, ge=0, lt=1.4)
    l1_m: Real = setting("distance of the origin from the joint", "m", gt=0)
    l2_m: Real = setting("distance of the insertion from the joint", "m", gt=0)
    delay_s: Real = setting("electromechanical delay", "s", 0.08, ge=0, le=0.5)
    shape_A: Real = setting("shape factor A of the activation, Eq. 2", "-", 0.2, ge=0, le=3)


class Joint(Section):
    """The forearm: a point mass on a rigid rod."""

    mass_kg: Real = setting("forearm mass, at the wrist", "kg", gt=0)
    length_m: Real = setting("forearm length", "m", gt=0)


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
    def parameters(self) -> set[str]:
        """Names of all physical constants: `f0_Bi`, ..., `mass`, `length`, `load`, `tilt`."""
        kinds = ("f0", "l0", "vmax", "slack", "pennation", "l1", "l2", "delay", "shape")
        return {f"{kind}_{muscle}" for kind in kinds for muscle in self.muscles} | {"mass", "length", "load", "tilt"}
