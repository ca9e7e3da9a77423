"""The section `targets`: what plain `snakemake` makes."""

from typing import Annotated, Any

from pydantic import Field, field_validator, model_validator

from myowave.settings.section import ModelName, Name, Once, Section, setting, without_null

Scales = Annotated[tuple[Annotated[int, Field(ge=1, le=5)], ...], Once]


class Targets(Section):
    """What plain `snakemake` makes. It changes no result, only which ones there are."""

    datasets: Annotated[tuple[str, ...], Once] = setting(
        "datasets whose networks are trained, and which are diagnosed", default=()
    )
    without_networks: Annotated[tuple[str, ...], Once] = setting(
        "further datasets: diagnosed, no network trained", default=()
    )
    models: dict[str, Annotated[tuple[ModelName, ...], Once]] = setting(
        "physical models by dataset, such as base+joint_damping; [base] for one not named", default=dict, each="dataset"
    )
    follow_verdict: Annotated[tuple[str, ...], Once] = setting(
        "datasets whose network is also trained with the physical model that the diagnosis finds", default=()
    )
    recipes: Annotated[tuple[str, ...], Once] = setting("recipes", default=("rollout",), min_length=1)
    own_recipes: dict[str, Annotated[tuple[str, ...], Once, Field(min_length=1)]] = setting(
        "recipes of a dataset that has its own, such as {human_curls: [recorded]}; else those of recipes",
        default=dict,
        each="dataset",
    )
    scales: Scales = setting("numbers of scales, 1 to 5: 3 trains at scales -2, -1, 0", "-", (1, 2, 3), min_length=1)
    own_scales: dict[Name, Annotated[Scales, Field(min_length=1)]] = setting(
        "numbers of scales of a recipe that has its own; else those of scales", "-", dict, each="recipe"
    )

    @field_validator("own_recipes", "own_scales", mode="before")
    @classmethod
    def _without_null(cls, value: Any) -> Any:
        """A file laid over another can only replace keys, so null takes one out."""
        return without_null(value)

    @model_validator(mode="after")
    def _something(self) -> "Targets":
        if not self.diagnosed:
            raise ValueError("name a dataset in datasets or in without_networks; both are empty")
        return self

    @property
    def diagnosed(self) -> tuple[str, ...]:
        """All datasets, each once."""
        return tuple(dict.fromkeys([*self.datasets, *self.without_networks]))

    def recipes_of(self, dataset: str) -> tuple[str, ...]:
        """The recipes that the networks of a dataset are trained with."""
        return self.own_recipes.get(dataset, self.recipes)

    def scales_of(self, recipe: str) -> tuple[int, ...]:
        """The numbers of scales that a recipe trains with."""
        return self.own_scales.get(recipe, self.scales)

    @property
    def trained(self) -> tuple[str, ...]:
        """All recipes that any dataset is trained with, each once."""
        return tuple(dict.fromkeys([*self.recipes, *(r for own in self.own_recipes.values() for r in own)]))
