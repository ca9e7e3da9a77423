"""The section `scales`."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

from pydantic import Field, ValidationError

from myowave.settings import Recipe, Settings
from myowave.settings.keys import explain, unless_known
from myowave.settings.section import Name, Once, Real, Section, Whole, WithoutNull, setting
from studies.section import StudySection


class Condition(Section):
    """What all ways are compared under: a recipe, and what is changed in it."""

    recipe: Name = setting("recipe that all ways train with; it identifies nothing here")
    changes: dict[Name, Any] = setting(
        "settings of the recipe that are others, {name: value}", "-", dict, each="setting"
    )
    datasets: Annotated[tuple[str, ...], Once] = setting("datasets; all of the comparison where empty", default=())
    ways: Annotated[tuple[str, ...], Once] = setting("ways to train; all where empty", default=())
    full: bool = setting("whether only the target scales_full runs it", default=False)


class Compared(Section):
    """A dataset of the comparison."""

    rate_hz: Real | None = setting("sampling rate that samples are averaged down to; null: as it is", "Hz", None, gt=0)


class Scales(StudySection):
    """Where training from coarse to fine helps."""

    datasets: Annotated[dict[Name, Compared], WithoutNull] = setting(
        "datasets to compare on; null: not this one", each="dataset"
    )
    conditions: Annotated[dict[Name, Condition], WithoutNull] = setting(
        "recipes to compare under; null: not this one", each="condition"
    )
    scales: Annotated[int, Field(ge=2, le=5)] = setting("number of scales of ways with several", "-")
    draws: Whole = setting("draws of each dataset: other motions, or other held-out trials", "-", ge=2, le=1000)
    seeds: Whole = setting("seeds of each draw", "-", ge=1, le=1000)

    def recipe_of(self, condition: str, recipes: Mapping[str, Recipe]) -> Recipe:
        """The recipe of a condition, in which physics teaches nothing, and nothing that validates stops a network."""
        named = self.conditions[condition]
        recipe = recipes[named.recipe]
        untaught = {"simulated_trials": 0, "beta": 0.0, "patience": None}
        untaught = {name: value for name, value in untaught.items() if name in type(recipe).model_fields}
        return recipe.changed(untaught | named.changes)

    def problems(self, settings: Settings) -> list[str]:
        """Names that are not there, and changes that a recipe cannot take."""
        problems = [p for name in self.datasets for p in unless_known(f"datasets.{name}", name, settings.data.datasets)]
        for name, condition in self.conditions.items():
            at = f"conditions.{name}"
            for i, dataset in enumerate(condition.datasets):
                problems += unless_known(f"{at}.datasets[{i}]", dataset, self.datasets)
            problems += _ways_problems(f"{at}.ways", condition.ways)
            problems += unless_known(f"{at}.recipe", condition.recipe, settings.learning.recipes)
            if recipe := settings.learning.recipes.get(condition.recipe):
                try:
                    self.recipe_of(name, settings.learning.recipes)
                except ValidationError as error:
                    problems += [f"{at}.changes: {line}" for line in explain(error, type(recipe))]
        return problems


def _ways_problems(at: str, ways: Sequence[str]) -> Iterator[str]:
    """Ways that there are not, and those without the way that they are compared with."""
    if not ways:
        return
    from studies.scales.ways import WAYS  # loads the wavelets, which settings do without

    for i, way in enumerate(ways):
        yield from unless_known(f"{at}[{i}]", way, WAYS)
        if way in WAYS and (against := WAYS[way].against) and against not in ways:
            yield f"{at}[{i}]: {way} is compared with {against}, which is not among them; add it."
