"""The section `targets`: what plain `snakemake` makes."""

from typing import Annotated

from pydantic import Field, model_validator

from myowave.settings.section import ModelName, Once, Section, WithoutNull, setting


class Targets(Section):
    """What plain `snakemake` makes. It changes no result, only which ones there are."""

    datasets: Annotated[tuple[str, ...], Once] = setting("datasets to train networks of and to diagnose", default=())
    without_networks: Annotated[tuple[str, ...], Once] = setting("further datasets, only to diagnose", default=())
    models: dict[str, Annotated[tuple[ModelName, ...], Once]] = setting(
        "physical models by dataset, such as base+joint_damping; [base] for one not named", default=dict, each="dataset"
    )
    follow_verdict: Annotated[tuple[str, ...], Once] = setting(
        "datasets whose network is also trained with the physical model that the diagnosis finds", default=()
    )
    recipes: Annotated[tuple[str, ...], Once] = setting("recipes", default=("rollout",), min_length=1)
    own_recipes: Annotated[dict[str, Annotated[tuple[str, ...], Once, Field(min_length=1)]], WithoutNull] = setting(
        "recipes of datasets that have their own, such as {human_curls: [recorded]}", default=dict, each="dataset"
    )
    scales: Annotated[tuple[Annotated[int, Field(ge=1, le=5)], ...], Once] = setting(
        "numbers of scales, 1 to 5: 3 trains at scales -2, -1, 0", "-", (1, 2, 3), min_length=1
    )

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
        return self.own_recipes.get(dataset, self.recipes)

    @property
    def trained(self) -> tuple[str, ...]:
        """All recipes that any dataset is trained with, each once."""
        return tuple(dict.fromkeys([*self.recipes, *(r for own in self.own_recipes.values() for r in own)]))
