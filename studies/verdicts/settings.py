"""The section `verdicts`."""

from typing import Annotated

from pydantic import Field

from myowave.settings import Settings, shipped_effects
from myowave.settings.keys import unless_known
from myowave.settings.section import Name, Once, Real, Whole, setting
from studies.section import StudySection

# Worlds: as the model assumes, and each other in one way; in the last, effects are not in the catalogue.
WORLDS = ("as_assumed", "other_curves", "other_constants", "other_data", "other_solver", "outside")


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
    cases: Whole = setting("datasets with an effect, for each world and noise", "-", ge=1, le=100_000)
    clean_sets: Whole = setting("datasets without an effect, for each world", "-", ge=1, le=100_000)
    angle_noises_deg: Annotated[tuple[Real, ...], Once] = setting(
        "noises of the angle in the world that is as assumed", "deg", min_length=1
    )
    angle_noise_deg: Real = setting("noise of the angle in the other worlds", "deg", gt=0, le=30)
    parts: Whole = setting("jobs that each world is cut into", "-", ge=1, le=1000)

    def problems(self, settings: Settings) -> list[str]:
        simulated = [name for name, dataset in settings.data.datasets.items() if dataset.kind == "simulated"]
        problems = unless_known("dataset", self.dataset, simulated, " among simulated ones")
        if not settings.physics.effect_files:  # else names are known only once they are loaded
            problems += [p for name in self.effects or () for p in unless_known("effects", name, shipped_effects())]
        return problems
