"""All of config.yaml in one object, and what its sections ask of one another."""

from collections.abc import Collection

from pydantic import ValidationError, model_validator

from myowave.settings.data import Data, RecordedDataset, force_and_length
from myowave.settings.diagnosis import Diagnosis
from myowave.settings.keys import did_you_mean, explain, list_keys
from myowave.settings.learning import SEARCHABLE, Learning, PlannedSweep, Recipe
from myowave.settings.physics import Physics
from myowave.settings.section import Section, dump, setting
from myowave.settings.targets import Targets
from myowave.settings.tracking import Tracking


class Settings(Section):
    """All of config.yaml."""

    targets: Targets = setting("what plain `snakemake` makes")
    physics: Physics = setting("the musculoskeletal model")
    data: Data = setting("trials and scales")
    learning: Learning = setting("training")
    diagnosis: Diagnosis = setting("diagnosis", default=Diagnosis)
    tracking: Tracking = setting("MLflow", default=Tracking)

    @model_validator(mode="after")
    def _identify_the_arms(self) -> "Settings":
        """What a dataset leaves open of `identify` is filled in for its arm."""
        datasets = dict(self.data.datasets)
        for name, dataset in datasets.items():
            if "identify" not in dataset.model_fields_set and dataset.arm in (None, *self.physics.arms):
                identify = force_and_length(self.physics.of_arm(dataset.arm))
                datasets[name] = dataset.model_copy(update={"identify": identify})
        return self.model_copy(update={"data": self.data.model_copy(update={"datasets": datasets})})

    @model_validator(mode="after")
    def _agree(self) -> "Settings":
        problems = [*self._problems_of_targets(), *self._problems_of_sweep()]
        problems += [*self._problems_of_study(), *self._problems_of_arms()]
        if problems:
            raise ValueError("\n".join(problems))
        return self

    def sweep(self) -> PlannedSweep:
        """The section learning.sweep, what is null in it filled in from the targets."""
        sweep, targets = self.learning.sweep, self.targets
        filled_in = {
            "dataset": sweep.dataset or targets.diagnosed[0],
            "recipe": sweep.recipe or targets.recipes[0],
            "scales": sweep.scales or max(targets.scales),
        }
        return PlannedSweep.model_validate(sweep.model_dump() | filled_in)

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
        if (scales := max(*targets.scales, self.learning.sweep.scales or 1)) > self.data.wavelet.levels + 1:
            problems.append(
                f"targets.scales, learning.sweep.scales: {scales} scales need data.wavelet.levels of {scales - 1}, "
                f"which is {self.data.wavelet.levels}."
            )
        return problems

    def _problems_of_sweep(self) -> list[str]:
        sweep = self.sweep()
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
                    lines = explain(error, tuple(list_keys(Recipe)))
                    problems += [f"{where}.{end} does not fit recipe {sweep.recipe}: {line}" for line in lines]
        return problems

    def _problems_of_study(self) -> list[str]:
        simulated = [name for name, dataset in self.data.datasets.items() if dataset.kind == "simulated"]
        return unless_known("diagnosis.study.dataset", self.diagnosis.study.dataset, simulated, " among simulated ones")

    def _problems_of_arms(self) -> list[str]:
        problems = []
        for name, dataset in self.data.datasets.items():
            where = f"data.datasets.{name}"
            if dataset.arm is not None and (unknown := unless_known(f"{where}.arm", dataset.arm, self.physics.arms)):
                problems += unknown
            else:
                problems += self._problems_of_constants(name)
        return problems

    def _problems_of_constants(self, name: str) -> list[str]:
        where, dataset, arm = f"data.datasets.{name}", self.data.datasets[name], self.physics_of(name)
        named = [(f"{where}.identify.{p}", p) for p in dataset.identify]
        named += [(f"{where}.constants.{p}", p) for p in dataset.constants]
        named += [(f"{where}.conditions.{t}.{p}", p) for t, c in dataset.conditions.items() for p in c]
        signals = getattr(dataset, "signals", {})
        named += [(f"{where}.signals.{s}.condition", v.condition) for s, v in signals.items() if v.condition]
        whose = " in the default arm" if dataset.arm is None else f" in arm {dataset.arm}"
        problems = []
        for path, parameter in named:
            if "." not in parameter:  # a parameter of an effect is checked where effects are known
                problems += unless_known(path, parameter, arm.parameters, whose)
        for parameter in set(dataset.identify) & set(dataset.constants):
            problems.append(f"{where}: {parameter} is both known (constants) and to identify; keep one of them.")
        if isinstance(dataset, RecordedDataset):
            for muscle, settings in arm.muscles.items():
                if settings.emg not in dataset.emg:
                    problems.append(
                        f"{where}.emg: muscle {muscle}{whose} is driven by {settings.emg}, which is not here; it has "
                        f"{', '.join(dataset.emg)}. Add the channel, or name another one as the muscle's emg."
                    )
        return problems


def unless_known(path: str, name: str, known: Collection[str], whose: str = "") -> list[str]:
    """No problem, or one: what is at `path` is not among the known names, of which `whose` says more."""
    if name in known:
        return []
    names = sorted(known)
    return [
        f"{path}: there is no {name!r}{whose}{did_you_mean(name, names) or '.'} Known: {', '.join(names) or 'none'}."
    ]
