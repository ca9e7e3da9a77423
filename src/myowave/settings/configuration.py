"""All of config.yaml in one object, and what its sections ask of one another."""

import operator
from collections.abc import Collection, Iterator, Mapping

from pydantic import ValidationError, model_validator

from myowave.physics.constants import (
    CURVE,
    GROUP_CONSTANTS,
    JOINT_CONSTANTS,
    MUSCLE_CONSTANTS,
    constant_of,
    constant_unit,
)
from myowave.settings.data import Data, Dataset, RecordedDataset, force_and_length
from myowave.settings.diagnosis import Diagnosis
from myowave.settings.keys import did_you_mean, explain, in_words
from myowave.settings.learning import SEARCHABLE, Learning, Recipe
from myowave.settings.physics import Arms, Physics
from myowave.settings.section import Section, dump, setting
from myowave.settings.targets import Targets
from myowave.settings.tracking import Tracking


class Settings(Section):
    """All of config.yaml."""

    targets: Targets = setting("what plain `snakemake` makes")
    physics: Arms = setting("the musculoskeletal model")
    data: Data = setting("trials and scales")
    learning: Learning = setting("training")
    diagnosis: Diagnosis = setting("diagnosis", default=Diagnosis)
    tracking: Tracking = setting("MLflow", default=Tracking)

    @model_validator(mode="after")
    def _identify_the_arms(self) -> "Settings":
        """What a dataset leaves open of `identify` is filled in for its arm."""
        datasets = dict(self.data.datasets)
        for name, dataset in datasets.items():
            if "identify" not in dataset.model_fields_set and dataset.arm in self.physics.arms:
                identify = force_and_length(self.physics.of_arm(dataset.arm))
                datasets[name] = dataset.model_copy(update={"identify": identify})
        return self.model_copy(update={"data": self.data.model_copy(update={"datasets": datasets})})

    @model_validator(mode="after")
    def _agree(self) -> "Settings":
        problems = [
            *self._problems_of_targets(),
            *self._problems_of_sweep(),
            *self._problems_of_scatter(),
            *self._problems_of_arms(),
        ]
        if problems:
            raise ValueError("\n".join(problems))
        return self

    def physics_of(self, dataset: str) -> Physics:
        """The physics of one dataset: its own arm, and no other."""
        return self.physics.of_arm(self.data.datasets[dataset].arm)

    def _problems_of_targets(self) -> list[str]:
        targets, datasets = self.targets, self.data.datasets
        problems = []
        for i, name in enumerate(targets.datasets):
            problems += unless_known(f"targets.datasets[{i}]", name, datasets)
        for i, name in enumerate(targets.without_networks):
            problems += unless_known(f"targets.without_networks[{i}]", name, datasets)
        for i, name in enumerate(targets.follow_verdict):
            problems += unless_known(f"targets.follow_verdict[{i}]", name, datasets)
        for name in targets.models:
            problems += unless_known(f"targets.models.{name}", name, datasets)
        for i, name in enumerate(targets.recipes):
            problems += unless_known(f"targets.recipes[{i}]", name, self.learning.recipes)
        for dataset, names in targets.own_recipes.items():
            problems += unless_known(f"targets.own_recipes.{dataset}", dataset, datasets)
            for i, name in enumerate(names):
                problems += unless_known(f"targets.own_recipes.{dataset}[{i}]", name, self.learning.recipes)
        for name in targets.own_scales:
            problems += unless_known(f"targets.own_scales.{name}", name, self.learning.recipes)
        further = [number for scales in targets.own_scales.values() for number in scales]
        scales = max(*targets.scales, *further, self.learning.sweep.scales)
        if scales > self.data.wavelet.levels + 1:
            problems.append(
                f"targets.scales, targets.own_scales, learning.sweep.scales: {scales} scales need "
                f"data.wavelet.levels of {scales - 1}, which is {self.data.wavelet.levels}."
            )
        return problems

    def _problems_of_sweep(self) -> list[str]:
        sweep = self.learning.sweep
        problems = unless_known("learning.sweep.dataset", sweep.dataset, self.data.datasets)
        problems += unless_known("learning.sweep.recipe", sweep.recipe, self.learning.recipes)
        if problems:
            return problems
        recipe = dump(self.learning.recipes[sweep.recipe])
        for name, dimension in sweep.dimensions.items():
            where = f"learning.sweep.dimensions.{name}"
            if unknown := unless_known(where, name, SEARCHABLE):
                problems += unknown
                continue
            for end, value in (("low", dimension.low), ("high", dimension.high)):
                try:
                    Recipe.model_validate(recipe | {name: int(value) if value.is_integer() else value})
                except ValidationError as error:
                    lines = explain(error, Recipe)
                    problems += [f"{where}.{end} does not fit recipe {sweep.recipe}: {line}" for line in lines]
        return problems

    def _problems_of_scatter(self) -> list[str]:
        """A constant may be named as such, or as that of one muscle or group of any arm."""
        constants = sorted({*MUSCLE_CONSTANTS, *GROUP_CONSTANTS, *JOINT_CONSTANTS})
        arms = self.physics.arms.values()
        full = sorted({parameter for arm in arms for parameter in arm.parameters})
        muscle = next(iter(next(iter(arms)).muscles))
        return [
            f"diagnosis.scatter.{name}: there is no {name!r}{did_you_mean(name, [*constants, *full]) or '.'} "
            f"Known: {', '.join(constants)}, each also for one muscle or group, as "
            f"slack_{muscle}; "
            f"{', '.join(p for p in full if p.endswith('_' + CURVE))}."
            for name in self.diagnosis.scatter
            if name not in constants and name not in full
        ]

    def _problems_of_arms(self) -> list[str]:
        problems = []
        for name, dataset in self.data.datasets.items():
            where = f"data.datasets.{name}"
            if unknown := unless_known(f"{where}.arm", dataset.arm, self.physics.arms):
                problems += unknown
            else:
                problems += self._problems_of_constants(name)
        return problems

    def _problems_of_constants(self, name: str) -> list[str]:
        where, dataset, arm = f"data.datasets.{name}", self.data.datasets[name], self.physics_of(name)
        whose = f" in arm {dataset.arm}"
        nominal = arm.nominal
        problems = []
        for path, parameter in _names(where, dataset):
            problems += unless_known(path, parameter, nominal, whose, _EFFECTS if "." in parameter else "")
        for path, parameter, value in _values(where, dataset):
            problems += out_of_bounds(path, parameter, value) if parameter in nominal else []
        known = {"constants": dataset.constants, "conditions": {p for c in dataset.conditions.values() for p in c}}
        for key, parameters in known.items():
            for parameter in sorted(set(dataset.identify) & set(parameters)):
                problems.append(f"{where}: {parameter} is both known ({key}) and to identify; keep one of them.")
        for parameter in dataset.identify:
            if nominal.get(parameter) == 0:
                problems.append(
                    f"{where}.identify.{parameter}: {parameter} is 0{whose}, so a search has nothing to start from. "
                    "Give the arm the value that you expect, or leave it out."
                )
        for trial, conditions in {"": {}, **dataset.conditions}.items():
            at = f"{where}.conditions.{trial}" if trial else f"{where}.constants"
            problems += _problems_of_body(at, nominal | dataset.constants | conditions) if arm.joint.com_m else []
        return problems + self._problems_of_signals(where, whose, dataset, arm)

    @staticmethod
    def _problems_of_signals(where: str, whose: str, dataset: Dataset, arm: Physics) -> list[str]:
        """Of a recorded dataset: channels that the arm needs, and conditions that no angle can be."""
        if not isinstance(dataset, RecordedDataset):
            return []
        problems = []
        for channel in dict.fromkeys(muscle.emg for muscle in arm.muscles.values() if muscle.emg not in dataset.emg):
            driven = [name for name, muscle in arm.muscles.items() if muscle.emg == channel]
            several = len(driven) > 1
            problems.append(
                f"{where}.emg: {'muscles' if several else 'muscle'} {', '.join(driven)}{whose} "
                f"{'are' if several else 'is'} driven by {channel}, which is not here; it has "
                f"{', '.join(dataset.emg)}. Add the channel, or name another one as the emg of "
                f"{'these muscles' if several else 'the muscle'}."
            )
        for signal, angle in dataset.signals.items():
            if angle.condition in arm.parameters and (unit := constant_unit(angle.condition)) != "rad":
                problems.append(
                    f"{where}.signals.{signal}.condition: {angle.condition} is in {unit}, and the signal is an angle; "
                    "expected a constant in rad, such as tilt."
                )
        return problems


_EFFECTS = (
    " A parameter of an effect is not set here: it is estimated wherever the model has the effect, within the bounds "
    "in the effect's file."
)


def _names(where: str, dataset: Dataset) -> Iterator[tuple[str, str]]:
    """Where a dataset names a physical constant, and which."""
    yield from ((f"{where}.identify.{p}", p) for p in dataset.identify)
    yield from ((f"{where}.constants.{p}", p) for p in dataset.constants)
    yield from ((f"{where}.hidden_constants.{p}", p) for p in getattr(dataset, "hidden_constants", ()))
    yield from ((f"{where}.conditions.{t}.{p}", p) for t, c in dataset.conditions.items() for p in c)
    for name, signal in getattr(dataset, "signals", {}).items():
        if signal.condition:
            yield f"{where}.signals.{name}.condition", signal.condition


def _values(where: str, dataset: Dataset) -> Iterator[tuple[str, str, float]]:
    """Where a dataset gives a value to a physical constant, which constant and what value."""
    hidden = getattr(dataset, "hidden_constants", {})
    for key, constants in (("constants", dataset.constants), ("hidden_constants", hidden)):
        yield from ((f"{where}.{key}.{p}", p, value) for p, value in constants.items())
    for trial, conditions in dataset.conditions.items():
        yield from ((f"{where}.conditions.{trial}.{p}", p, value) for p, value in conditions.items())
    for parameter, choice in dataset.identify.items():
        given = {"low": [choice.low], "high": [choice.high], "literature": choice.literature}
        for key, values in given.items():
            yield from ((f"{where}.identify.{parameter}.{key}", parameter, v) for v in values if v is not None)


def out_of_bounds(path: str, name: str, value: float) -> list[str]:
    """No problem, or one: the value at `path` is none that the physical constant of this name may have."""
    constant = constant_of(name)
    if all(_WITHIN[bound](value, limit) for bound, limit in constant.bounds.items()):
        return []
    return [
        f"{path} = {value:g}: expected a number, {', '.join(in_words(constant.bounds))} [{constant.unit}] "
        f"({constant.meaning})."
    ]


_WITHIN = {"gt": operator.gt, "ge": operator.ge, "lt": operator.lt, "le": operator.le}


def _problems_of_body(at: str, constants: Mapping[str, float]) -> list[str]:
    """Whether a rigid forearm can have such an inertia."""
    least = constants["mass"] * constants["com"] ** 2
    if constants["inertia"] >= least:
        return []
    return [
        f"{at}: the forearm's inertia is {constants['inertia']:g}, but about the elbow it is at least mass com^2 = "
        f"{least:g} kg m^2; give mass, com and inertia together."
    ]


def unless_known(path: str, name: str, known: Collection[str], whose: str = "", more: str = "") -> list[str]:
    """No problem, or one: what is at `path` is not among the known names, of which `whose` says more."""
    if name in known:
        return []
    names = sorted(known)
    return [
        f"{path}: there is no {name!r}{whose}{did_you_mean(name, names) or '.'} Known: {', '.join(names) or 'none'}."
        + more
    ]
