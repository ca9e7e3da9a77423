"""All of config.yaml in one object: from parsed YAML to settings, or to a message with a line for each problem."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError, model_validator

from myowave.physics.constants import CURVE, GROUP_CONSTANTS, JOINT_CONSTANTS, MUSCLE_CONSTANTS
from myowave.settings.data import Data, Dataset, force_and_length
from myowave.settings.dataset_check import check_dataset
from myowave.settings.diagnosis import DiagnosisSettings
from myowave.settings.files import read_layers
from myowave.settings.keys import did_you_mean, explain, unless_known
from myowave.settings.learning import Learning, Sweep
from myowave.settings.physics import Arms, Physics
from myowave.settings.section import Address, Section, setting
from myowave.settings.subjects import add_subjects
from myowave.settings.targets import Targets


class Tracking(Section):
    """Where MLflow shows the results; they are on disk with or without it."""

    uri: Address = setting(
        "MLflow store: sqlite:///FILE, or the http(s) address of a server",
        default="sqlite:///results/mlflow.db",
        pattern=r"^(sqlite:///.+|https?://\S+)$",
    )


class Settings(Section):
    """All of config.yaml."""

    targets: Targets = setting("what plain `snakemake` makes")
    physics: Arms = setting("the musculoskeletal model")
    data: Data = setting("trials and scales")
    learning: Learning = setting("training")
    diagnosis: DiagnosisSettings = setting("diagnosis", default=DiagnosisSettings)
    tracking: Tracking = setting("MLflow", default=Tracking)

    @model_validator(mode="after")
    def _identify_the_arms(self) -> "Settings":
        """What a dataset leaves open of `identify` is filled in for its arm."""
        datasets = dict(self.data.datasets)
        for name, dataset in datasets.items():
            if "identify" not in dataset.model_fields_set and dataset.arm in self.physics.arms:
                identify = force_and_length(self.physics.arms[dataset.arm])
                datasets[name] = dataset.model_copy(update={"identify": identify})
        return self.model_copy(update={"data": self.data.model_copy(update={"datasets": datasets})})

    @model_validator(mode="after")
    def _agree(self) -> "Settings":
        problems = [problem for path, name, known in self._named() for problem in unless_known(path, name, known)]
        if not problems:  # what is called by a name is there
            problems = [*self._problems_of_datasets(), *self._problems_of_scatter()]
            problems += self._problems_of_sweep(self.learning.sweep) if self.learning.sweep else []
        if problems:
            raise ValueError("\n".join(problems))
        return self

    def dataset(self, name: str) -> Dataset:
        """A dataset by its name.

        Raises:
            ValueError: if there is none of that name.
        """
        if name not in self.data.datasets:
            meant = did_you_mean(name, self.data.datasets) or "."
            raise ValueError(
                f"There is no dataset {name!r} in the settings{meant} There are {', '.join(self.data.datasets)}; "
                "--config names further files of settings."
            )
        return self.data.datasets[name]

    def physics_of(self, dataset: str) -> Physics:
        """The physics of one dataset: its own arm, and no other."""
        return self.physics.of_arm(self.data.datasets[dataset].arm)

    def diagnosis_of(self, dataset: str) -> DiagnosisSettings:
        """The diagnosis of one dataset, with what is known of its constants."""
        scatter = {**self.diagnosis.scatter, **self.data.datasets[dataset].scatter}
        return self.diagnosis.model_copy(update={"scatter": scatter})

    def _named(self) -> Iterator[tuple[str, str, Collection[str]]]:
        """What is called by a name: where, the name, and the names that there are."""
        targets, sweep, datasets, recipes = self.targets, self.learning.sweep, self.data.datasets, self.learning.recipes
        for key in ("datasets", "without_networks", "follow_verdict", "models", "own_recipes"):
            yield from ((f"targets.{key}", name, datasets) for name in getattr(targets, key))
        yield from (("targets.recipes", name, recipes) for name in targets.recipes)
        for dataset, names in targets.own_recipes.items():
            yield from ((f"targets.own_recipes.{dataset}", name, recipes) for name in names)
        if sweep is not None:
            yield "learning.sweep.dataset", sweep.dataset, datasets
            yield "learning.sweep.recipe", sweep.recipe, recipes
        yield from ((f"data.datasets.{name}.arm", of.arm, self.physics.arms) for name, of in datasets.items())
        if not self.physics.effect_files:  # their effects are known once they are loaded: a job finds out
            shipped = shipped_effects()
            for dataset, models in targets.models.items():
                added = (effect for model in models for effect in model.split("+")[1:])
                yield from ((f"targets.models.{dataset}", effect, shipped) for effect in added)
            for name, of in datasets.items():
                hidden = getattr(of, "hidden_effect", ())
                yield from ((f"data.datasets.{name}.hidden_effect", effect, shipped) for effect in hidden)

    def _problems_of_datasets(self) -> list[str]:
        problems = [
            f"targets.datasets: the arm of {name} has no muscles, so there is no EMG for a network; name it under "
            "without_networks."
            for name in self.targets.datasets
            if not self.physics_of(name).muscles
        ]
        for name, dataset in self.data.datasets.items():
            problems += check_dataset(f"data.datasets.{name}", dataset, self.physics_of(name))
        sweep, levels = self.learning.sweep, self.data.wavelet.levels
        if (scales := max([*self.targets.scales, *([sweep.scales] if sweep else [])])) > levels + 1:
            problems.append(
                f"targets.scales, learning.sweep.scales: {scales} scales need data.wavelet.levels of {scales - 1}, "
                f"which is {levels}."
            )
        return problems

    def _problems_of_sweep(self, sweep: Sweep) -> list[str]:
        """Settings that are none of the recipe's, and ranges with an end that is no value of theirs."""
        recipe, problems = self.learning.recipes[sweep.recipe], []
        for name, dimension in sweep.dimensions.items():
            where = f"learning.sweep.dimensions.{name}"
            if unknown := unless_known(where, name, recipe.searchable()):
                problems += unknown
                continue
            for end, value in (("low", dimension.low), ("high", dimension.high)):
                try:
                    recipe.changed({name: int(value) if value.is_integer() else value})
                except ValidationError as error:
                    lines = explain(error, type(recipe))
                    problems += [f"{where}.{end} does not fit recipe {sweep.recipe}: {line}" for line in lines]
        return problems

    def _problems_of_scatter(self) -> list[str]:
        """A constant may be named as such, or as that of one muscle or group of any arm."""
        constants = sorted({*MUSCLE_CONSTANTS, *GROUP_CONSTANTS, *JOINT_CONSTANTS})
        full = sorted({name for arm in self.physics.arms.values() for name in arm.nominal})
        curves = [name for name in full if name.endswith(f"_{CURVE}")]
        of_datasets = ((f"data.datasets.{name}", of.scatter) for name, of in self.data.datasets.items())
        return [
            f"{where}.scatter.{name}: there is no {name!r}{did_you_mean(name, [*constants, *full]) or '.'} Known: "
            f"{', '.join(constants)}, each also for one muscle or group, as slack_Bi; {', '.join(curves)}."
            for where, scatter in (("diagnosis", self.diagnosis.scatter), *of_datasets)
            for name in scatter
            if name not in (*constants, *full)
        ]


def shipped_effects() -> list[str]:
    """Names of the effects that ship, taken from file names: loading the physics takes a second."""
    folder = Path(__file__).parents[1] / "physics" / "effects"
    return sorted(path.stem for path in folder.glob("[!_]*.py"))


def parse_settings(config: Mapping[str, Any]) -> Settings:
    """Check a parsed config.yaml, the datasets of its table of subjects among the others.

    Raises:
        ValueError: one line per problem, each with the key, what was found and what is allowed.
    """
    try:
        return Settings.model_validate(add_subjects(config))
    except ValidationError as error:
        raise ValueError("\n".join(explain(error, Settings))) from None


def read_settings(paths: Iterable[Path]) -> Settings:
    """The settings in YAML files, each laid over those before.

    Raises:
        ValueError: for a file that is not there, is not YAML, or has wrong keys.
    """
    return parse_settings(read_layers(paths))
