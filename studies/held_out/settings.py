"""The section `held_out`."""

from typing import Annotated

from pydantic import Field

from myowave.settings import RecordedDataset, Settings
from myowave.settings.keys import unless_known
from myowave.settings.section import Name, Once, TrialName, setting
from studies.section import StudySection


class HeldOut(StudySection):
    """Networks with other trials held out in turn, by number of scales."""

    dataset: Name = setting("dataset")
    recipe: Name = setting("recipe")
    scales: Annotated[tuple[Annotated[int, Field(ge=1, le=5)], ...], Once] = setting("numbers of scales", min_length=1)
    test: Annotated[tuple[tuple[TrialName, ...], ...], Once] = setting(
        "sets of trials that test in turn, [[trial, ...], ...]; the others of the dataset train", min_length=1
    )

    def problems(self, settings: Settings) -> list[str]:
        problems = unless_known("dataset", self.dataset, settings.data.datasets)
        problems += unless_known("recipe", self.recipe, settings.learning.recipes)
        if max(self.scales) > settings.data.wavelet.levels + 1:
            problems.append(f"scales: {max(self.scales)} scales need data.wavelet.levels of one less.")
        dataset = settings.data.datasets.get(self.dataset)
        if isinstance(dataset, RecordedDataset):
            for i, names in enumerate(self.test):
                problems += [p for name in names for p in unless_known(f"test[{i}]", name, dataset.trials)]
                if not set(dataset.trials) - set(names):
                    problems.append(f"test[{i}]: names every trial ({', '.join(names)}); leave some to train on.")
        return problems
