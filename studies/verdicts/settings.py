"""The section `verdicts`."""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from myowave.settings import Settings, shipped_effects
from myowave.settings.keys import unless_known
from myowave.settings.section import Name, Once, Real, Section, Whole, setting
from studies.section import StudySection

# As the model assumes, each other in one way, all of these at once, and arms of another simulator.
WORLDS = (
    "as_assumed",
    "other_curves",
    "other_constants",
    "other_sensors",
    "other_solver",
    "outside",
    "all_at_once",
    "other_simulator",
)
WorldName = Literal[
    "as_assumed",
    "other_curves",
    "other_constants",
    "other_sensors",
    "other_solver",
    "outside",
    "all_at_once",
    "other_simulator",
]


class Count(Section):
    """Sets of a world."""

    hidden: Whole = setting("with a hidden effect", "-", ge=0, le=10_000)
    clean: Whole = setting("without one", "-", ge=0, le=10_000)


class Verdicts(StudySection):
    """How often the diagnosis is right: effects hidden in simulated trials."""

    dataset: Name = setting("simulated dataset whose trials the effects are hidden in")
    effects: Annotated[tuple[Name, ...], Once] | None = setting(
        "effects to hide, one at a time; null: all that ship", default=None, min_length=1
    )
    strengths: Annotated[tuple[Annotated[Real, Field(gt=0, le=1)], ...], Once] = setting(
        "strengths of the hidden effects, as fractions of twice the typical one, or of what bounds allow",
        "-",
        min_length=1,
    )
    sets: Mapping[WorldName, Count] = setting("sets of each world, in each draw")
    draws: Annotated[tuple[Whole, ...], Once] = setting(
        "seeds of the draws; 1 was looked at while the method was made", min_length=1
    )
    angle_noises_deg: Annotated[tuple[Real, ...], Once] = setting(
        "noises of the angle in the world that is as assumed", "deg", min_length=1
    )
    angle_noise_deg: Real = setting("noise of the angle in the other worlds", "deg", gt=0, le=30)
    judges: Annotated[tuple[Name, ...], Once] = setting("what judges each set", min_length=1)

    def problems(self, settings: Settings) -> list[str]:
        simulated = [name for name, dataset in settings.data.datasets.items() if dataset.kind == "simulated"]
        problems = unless_known("dataset", self.dataset, simulated, " among simulated ones")
        if not settings.physics.effect_files:  # else names are known only once they are loaded
            problems += [p for name in self.effects or () for p in unless_known("effects", name, shipped_effects())]
        return problems
