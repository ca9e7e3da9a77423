"""All of config.yaml in one object: from parsed YAML to settings, or to a message with a line for each problem."""

import operator
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError, model_validator

from myowave.physics.constants import CURVE, GROUP_CONSTANTS, JOINT_CONSTANTS, MUSCLE_CONSTANTS, constant_of
from myowave.settings.data import Data, Dataset, RecordedDataset, SimulatedDataset, force_and_length
from myowave.settings.diagnosis import DiagnosisSettings
from myowave.settings.files import read_layers
from myowave.settings.keys import did_you_mean, explain, in_words, unless_known
from myowave.settings.learning import Learning, Sweep
from myowave.settings.physics import Arm, Arms, Physics
from myowave.settings.section import Address, ModelName, Once, Section, WithoutNull, setting
from myowave.settings.subjects import add_subjects

_EFFECTS = (
    " A parameter of an effect is not set here: it is estimated wherever the model has the effect, within the bounds "
    "in the effect's file."
)


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
        """A dataset by its name; a ValueError if there is none of that name."""
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
            named = [(f"targets.models.{dataset}", model) for dataset, of in targets.models.items() for model in of]
            named += [("learning.sweep.model", sweep.model)] if sweep else []
            for where, model in named:
                yield from ((where, effect, shipped) for effect in model.split("+")[1:])
            for name, of in datasets.items():
                hidden = getattr(of, "hidden_effect", ())
                yield from ((f"data.datasets.{name}.hidden_effect", effect, shipped) for effect in hidden)

    def _problems_of_datasets(self) -> list[str]:
        trained = [("targets.datasets", name, "it under without_networks") for name in self.targets.datasets]
        trained += [("learning.sweep.dataset", self.learning.sweep.dataset, "another")] if self.learning.sweep else []
        problems = [
            f"{where}: the arm of {name} has no muscles, so there is no EMG for a network; name {instead}."
            for where, name, instead in trained
            if not self.physics_of(name).muscles
        ]
        for name, dataset in self.data.datasets.items():
            problems += _problems_of_dataset(f"data.datasets.{name}", dataset, self.physics_of(name))
        sweep, levels = self.learning.sweep, self.data.wavelet.levels
        if (scales := max([*self.targets.scales, *([sweep.scales] if sweep else [])])) > levels + 1:
            problems.append(
                f"targets.scales, learning.sweep.scales: {scales} scales need data.wavelet.levels of {scales - 1}, "
                f"which is {levels}."
            )
        return problems + self._problems_of_epochs()

    def _problems_of_epochs(self) -> list[str]:
        """Numbers of epochs that leave scales without any."""
        targets, sweep, recipes = self.targets, self.learning.sweep, self.learning.recipes
        trained = dict.fromkeys(recipe for name in targets.datasets for recipe in targets.recipes_of(name))
        asked: list[tuple[str, float, str, int]] = [
            (f"recipes.{name}.epochs", recipes[name].epochs, "targets", max(targets.scales)) for name in trained
        ]
        if sweep is not None:
            counts: dict[str, float] = {f"recipes.{sweep.recipe}.epochs": recipes[sweep.recipe].epochs}
            if "epochs" in sweep.dimensions:
                counts["sweep.dimensions.epochs.low"] = sweep.dimensions["epochs"].low
            elif sweep.epochs is not None:
                counts["sweep.epochs"] = sweep.epochs
            asked += [(key, count, "learning.sweep", sweep.scales) for key, count in counts.items()]
        return [
            f"learning.{key} = {count:g}: expected at least {scales}, an epoch for each of the {scales} scales that "
            f"{whose}.scales asks for. Train for more epochs, or at fewer scales."
            for key, count, whose, scales in asked
            if count < scales
        ]

    def _problems_of_sweep(self, sweep: Sweep) -> list[str]:
        """Too few trials, settings that are none of the recipe's, and ranges with an end that is no value of theirs."""
        recipe, dataset, problems = self.learning.recipes[sweep.recipe], self.data.datasets[sweep.dataset], []
        trials = getattr(dataset, "trials", ())  # those of a measured one are not known before its files are looked up
        if (trials if isinstance(trials, int) else len(trials)) - len(dataset.test) == 1:
            problems.append(
                f"learning.sweep.dataset: {sweep.dataset} has one training trial, and a sweep holds each out in turn; "
                "expected two or more. Name another dataset, or fewer test trials in it."
            )
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


def _problems_of_dataset(where: str, dataset: Dataset, arm: Arm) -> list[str]:
    """One line for each thing that a dataset, which stands at `where`, asks of its arm and does not find there."""
    whose, nominal = f" in arm {dataset.arm}", arm.nominal
    problems = []
    if isinstance(dataset, SimulatedDataset) and not arm.muscles:
        problems.append(f"{where}.arm: {dataset.arm} has no muscles, and EMG moves simulated trials; name another arm.")
    for path, name, values in _constants(dataset):
        problems += unless_known(f"{where}.{path}", name, nominal, whose, _EFFECTS if "." in name else "")
        if name in nominal:
            problems += _out_of_bounds(f"{where}.{path}", name, values)
    conditions = {f"conditions.{trial}": known for trial, known in dataset.conditions.items()}
    for at, known in {"constants": {}, **conditions}.items():
        problems += _problems_of_body(f"{where}.{at}", nominal | dataset.constants | known)
    named = {"constants": dataset.constants, "conditions": {p for c in conditions.values() for p in c}}
    problems += [
        f"{where}: {name} is both known ({key}) and to identify; keep one of them."
        for key, names in named.items()
        for name in sorted({*names} & {*dataset.identify})
    ]
    problems += [
        f"{where}.identify.{name}: {name} is 0{whose}, so a search has nothing to start from. Give the arm the value "
        "that you expect, or leave it out."
        for name in dataset.identify
        if nominal.get(name) == 0
    ]
    return problems + (_problems_of_signals(where, dataset, arm) if isinstance(dataset, RecordedDataset) else [])


def _constants(dataset: Dataset) -> Iterator[tuple[str, str, dict[str, float]]]:
    """Where a dataset names a physical constant, which, and what values it gives it, by the key below that place."""
    known = {"constants": dataset.constants, "hidden_constants": getattr(dataset, "hidden_constants", {})}
    known |= {f"conditions.{trial}": conditions for trial, conditions in dataset.conditions.items()}
    for key, constants in known.items():
        yield from ((f"{key}.{name}", name, {"": value}) for name, value in constants.items())
    for name, choice in dataset.identify.items():
        bounds = {".low": choice.low, ".high": choice.high}
        yield f"identify.{name}", name, {key: value for key, value in bounds.items() if value is not None}
    for signal, angle in getattr(dataset, "signals", {}).items():
        if angle.condition:
            yield f"signals.{signal}.condition", angle.condition, {}


def _out_of_bounds(path: str, name: str, values: Mapping[str, float]) -> list[str]:
    """Those of the values that the physical constant of this name cannot have."""
    constant = constant_of(name)
    return [
        f"{path}{key} = {value:g}: expected a number, {', '.join(in_words(constant.bounds))} [{constant.unit}] "
        f"({constant.meaning})."
        for key, value in values.items()
        if not all(getattr(operator, bound)(value, limit) for bound, limit in constant.bounds.items())
    ]


def _problems_of_body(at: str, constants: Mapping[str, float]) -> list[str]:
    """Whether a rigid forearm can have such an inertia; a point mass has none."""
    if not {"com", "inertia"} <= constants.keys():
        return []
    if constants["inertia"] >= (least := constants["mass"] * constants["com"] ** 2):
        return []
    return [
        f"{at}: the forearm's inertia is {constants['inertia']:g}, but about the elbow it is at least mass com^2 = "
        f"{least:g} kg m^2; give mass, com and inertia together."
    ]


def _problems_of_signals(where: str, dataset: RecordedDataset, arm: Arm) -> list[str]:
    """Channels that the arm needs, and conditions that no angle can be."""
    problems = []
    if dataset.emg and not arm.muscles:
        problems.append(
            f"{where}.emg: no muscle of arm {dataset.arm} is driven by {', '.join(dataset.emg)}. Give each muscle its "
            "channel under physics.arms (emg: ...); null leaves a muscle out."
        )
    for channel in arm.channels:
        if channel not in dataset.emg:
            driven = ", ".join(name for name, muscle in arm.muscles.items() if muscle.emg == channel)
            problems.append(
                f"{where}.emg: {channel}, which drives {driven} in arm {dataset.arm}, is not here; there are "
                f"{', '.join(dataset.emg) or 'none'}. Add the channel, or name another one as the emg of {driven}."
            )
    for signal, angle in dataset.signals.items():
        if angle.condition in arm.nominal and (unit := constant_of(angle.condition).unit) != "rad":
            problems.append(
                f"{where}.signals.{signal}.condition: {angle.condition} is in {unit}, and the signal is an angle; "
                "expected a constant in rad, such as tilt."
            )
    return problems


def shipped_effects() -> list[str]:
    """Names of the effects that ship, taken from file names: loading the physics takes a second."""
    folder = Path(__file__).parents[1] / "physics" / "effects"
    return sorted(path.stem for path in folder.glob("[!_]*.py"))


def parse_settings(config: Mapping[str, Any]) -> Settings:
    """Check a parsed config.yaml, the datasets of its table of subjects among the others. A ValueError has a line for
    each problem: the key, what was found and what is allowed."""
    try:
        return Settings.model_validate(add_subjects(config))
    except ValidationError as error:
        problems = explain(error, Settings)
        if any(field.is_required() and section not in config for section, field in Settings.model_fields.items()):
            problems.append("config.yaml has all sections: name it before a file of your own, which is laid over it.")
        raise ValueError("\n".join(problems)) from None


def read_settings(paths: Iterable[Path], option: str = "--config") -> Settings:
    """The settings in YAML files, each laid over those before. A ValueError for a file that is not there, which a
    caller names by `option`, is not YAML, or has wrong keys."""
    return parse_settings(read_layers(paths, option))
