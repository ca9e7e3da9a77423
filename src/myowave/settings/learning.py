"""The section `learning`: recipes, baselines beside them, and the sweep that improves a recipe."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from myowave.settings.section import ModelName, Name, Once, Real, Section, Whole, WithoutNull, setting


class Inputs(Section):
    """What a network or a baseline sees of a trial."""

    rate_hz: Real | None = setting(
        "about how many samples a second it sees, of trials that have more; null: all", "Hz", None, gt=0, le=2500
    )
    known_inputs: Annotated[tuple[Name, ...], Once] | None = setting(
        "what it is told of what is known and differs between training trials, such as [load]; null: all", "", None
    )
    emg_over: Literal["maximum", "weight"] = setting(
        "what EMG is divided by: maximum, what counts as 1; weight, that and the torque that holds the level forearm "
        "with the known load, so that EMG means the same with every load",
        default="maximum",
    )


class Recipe(Inputs):
    """What recipes of all methods have. A further method is a further class, and an entry in `learning.methods`."""

    method: str
    hidden: Whole = setting("hidden units", "-", 50, ge=1, le=4096)
    emg_input: Literal["recorded", "delayed"] = setting(
        "EMG that the network sees: e(t), or the excitation u(t) = e(t - d), Eq. 1", "", "recorded"
    )
    history_steps: Whole = setting("past samples of known angle that a prediction starts from", "-", 4, ge=1, le=100)
    epochs: Whole = setting("epochs of all scales together", "-", 1500, ge=1, le=1_000_000)
    learning_rate: Real = setting("initial step of the optimiser", "-", 3e-3, gt=0, le=1)
    validation_fraction: Real = setting(
        "share of the training trials, at their ends, kept for early stopping and for the 90 % band about predictions, "
        "which only the identification sees; 0: they all train, to the last epoch, and the band is made of errors on "
        "each training trial in turn, by networks that are trained without it",
        "-",
        0.1,
        ge=0,
        lt=0.9,
    )
    patience: Whole | None = setting(
        "epochs without a better validation error before a scale stops; null: never", "-", None, ge=1, le=1_000_000
    )

    def changed(self, changes: Mapping[str, Any]) -> Self:
        """The recipe with some settings replaced, checked like any other."""
        return type(self).model_validate(self.model_dump() | dict(changes))

    @classmethod
    def searchable(cls) -> dict[str, type]:
        """Settings that a sweep may search, with their types."""
        types: dict[Any, type] = {int: int, float: float}
        annotations = {name: field.annotation for name, field in cls.model_fields.items()}
        return {name: types[kind] for name, kind in annotations.items() if kind in types}


class RolloutRecipe(Recipe):
    """A network fed by its own predictions, beside an identification by Gauss-Newton steps."""

    method: Literal["rollout"] = setting("fed by its own predictions", default="rollout")
    rollout_s: Real = setting("time fed by the network's own predictions", "s", 1.6, gt=0, le=60)
    optimiser: Literal["adam", "soap"] = setting(
        "what moves the weights: Adam; or soap, Adam in the basis where a layer's gradient is least correlated",
        default="adam",
    )
    simulated_trials: Whole = setting(
        "trials to train on that are simulated with the identified parameters and new EMG", "-", 64, ge=0, le=10_000
    )
    emg_gain: Real = setting("SD of the logarithm of gains drawn for EMG in training windows", "-", 0.0, ge=0, le=1)
    known_noise: Real = setting(
        "noise of what is known beside EMG, a value for a window, over its scatter in training", "-", 0.0, ge=0, le=10
    )


class PaperRecipe(Recipe):
    """The method of the paper: one-step predictions, and parameters that move with the weights on one loss, by Adam."""

    method: Literal["paper"] = setting("one-step predictions, as the paper prints them", default="paper")
    beta: Real = setting("weight of the physics residual in the network's loss, Eq. 16", "-", 0.0, ge=0, le=1e12)
    history_noise: Real = setting("noise added to the history while training", "rad", 0.0, ge=0, le=1)
    residual: Literal["time", "sequence", "averaged", "measured", "split"] = setting(
        "what the residual of Eq. 38 is: time, with derivatives of the network by its input t_n; sequence, with "
        "differences of the predicted angles; averaged, the same with the torque's mean over the kernel of the second "
        "difference; measured, that along the measured angles; split, averaged: predicted angles teach the weights, "
        "measured ones the parameters",
        default="split",
    )
    parameter_pace: Real = setting("Adam's step for the parameters over that for the weights", "-", 1.0, gt=0, le=1000)
    batches: Whole = setting(
        "steps of Adam in an epoch, on random pieces of trials; 1: on all", "-", 1, ge=1, le=10_000
    )


RECIPES: Mapping[str, type[Recipe]] = {"rollout": RolloutRecipe, "paper": PaperRecipe}  # by their `method`
SEARCHABLE = RolloutRecipe.searchable() | PaperRecipe.searchable()


def parse_recipe(values: Mapping[str, Any]) -> Recipe:
    """A recipe from plain data, as rules are given it."""
    return RECIPES[values["method"]].model_validate(values)


class Baseline(Inputs):
    """A rival of the networks without physics or scales: the same trials and scores."""

    kind: Literal["hold", "ridge", "trees", "gru", "convolution"] = setting(
        "hold, the last given angle; of lagged EMG: ridge, linear, and trees, boosted; gru, a recurrent network that "
        "sees no angle; convolution, four dilated causal layers"
    )


class Dimension(Section):
    """The range in which a sweep looks for a setting."""

    low: Real = setting("lowest value to try", "as the setting")
    high: Real = setting("highest value to try", "as the setting")
    log: bool = setting("whether to search in the logarithm", default=False)

    @model_validator(mode="after")
    def _ordered(self) -> "Dimension":
        if self.low >= self.high:
            raise ValueError(f"low {self.low:g} must be below high {self.high:g}")
        if self.log and self.low <= 0:
            raise ValueError(f"low is {self.low:g}; a search in the logarithm needs more than 0")
        return self


class Sweep(Section):
    """`snakemake sweep`: a search for better settings of a recipe, judged on each training trial in turn."""

    dataset: Name = setting("dataset")
    model: ModelName = setting("physical model", default="base")
    recipe: Name = setting("recipe to improve")
    scales: Whole = setting("number of scales", "-", 1, ge=1, le=5)
    dimensions: Annotated[dict[Name, Dimension], WithoutNull] = setting(
        "ranges to search, {numeric setting of the recipe: range}; null: not searched", each="setting", min_length=1
    )
    trials: Whole = setting("settings to try; a larger number later goes on from there", "-", 20, ge=1, le=100_000)
    workers: Whole = setting("jobs that search side by side", "-", 2, ge=1, le=1000)
    seeds: Whole = setting("independent starts of each setting; their mean error counts", "-", 2, ge=1, le=1000)
    epochs: Whole | None = setting(
        "epochs of all scales of one start; null: the recipe's", "-", None, ge=1, le=1_000_000
    )


class Learning(Section):
    """The surrogate and the identification that comes with it."""

    seeds: Whole = setting("independent starts, trained together", "-", 5, ge=1, le=1000)
    recipes: dict[Name, Annotated[RolloutRecipe | PaperRecipe, Field(discriminator="method")]] = setting(
        "ways to train, by name", each="recipe", min_length=1
    )
    baselines: Annotated[dict[Name, Baseline], WithoutNull] = setting(
        "predictors without physics or scales to stand beside the networks, by name", default=dict, each="baseline"
    )
    sweep: Sweep | None = setting("search for better settings of a recipe; null: none", default=None)

    @model_validator(mode="after")
    def _one_name_each(self) -> "Learning":
        if twice := sorted(set(self.recipes) & set(self.baselines)):
            raise ValueError(f"baselines: {', '.join(twice)} is the name of a recipe as well; use another.")
        return self
