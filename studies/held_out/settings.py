"""The section `held_out`."""

from typing import Annotated, Literal

from pydantic import Field

from myowave.settings import RecordedDataset, Settings
from myowave.settings.keys import unless_known
from myowave.settings.section import Name, Once, Section, TrialName, Whole, WithoutNull, setting
from studies.shared import StudySection

Question = Literal["like_the_others", "unseen_load", "few_trials", "unseen_lean"]


class Split(Section):
    """Which trials train and which test."""

    train: Annotated[tuple[TrialName, ...], Once] = setting("trials that train", min_length=1)
    test: Annotated[tuple[TrialName, ...], Once] = setting("trials that test, each scored by itself", min_length=1)


class HeldOut(StudySection):
    """Networks and baselines on trials that ask something of them."""

    dataset: Name = setting("dataset")
    recipe: Name = setting("recipe; the baselines are those of learning.baselines")
    scales: Annotated[tuple[Annotated[int, Field(ge=1, le=5)], ...], Once] = setting("numbers of scales", min_length=1)
    seeds: Whole = setting("independent starts", "-", 5, ge=1, le=1000)
    questions: Annotated[dict[Question, Annotated[dict[str, Split], WithoutNull]], WithoutNull] = setting(
        "splits of the trials by question and name; null: not this one", each="question"
    )

    def problems(self, settings: Settings) -> list[str]:
        problems = unless_known("dataset", self.dataset, settings.data.datasets)
        problems += unless_known("recipe", self.recipe, settings.learning.recipes)
        if max(self.scales) > settings.data.wavelet.levels + 1:
            problems.append(f"scales: {max(self.scales)} scales need data.wavelet.levels of one less.")
        dataset = settings.data.datasets.get(self.dataset)
        for question, name, split in self.splits():
            where = f"questions.{question}.{name}"
            if isinstance(dataset, RecordedDataset):
                named = [*split.train, *split.test]
                problems += [p for trial in named for p in unless_known(where, trial, dataset.trials)]
            if both := sorted(set(split.train) & set(split.test)):
                problems.append(f"{where}: {', '.join(both)} would train and test; keep it in one of them.")
        return problems

    def splits(self) -> list[tuple[str, str, Split]]:
        """Question, name and split of all."""
        return [(question, name, split) for question, of in self.questions.items() for name, split in of.items()]
