"""A diagnosis from Python: what the rules of the workflow do with files, with the same functions."""

import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd
from pydantic import ValidationError

from myowave.data.checks.finding import in_sentences
from myowave.data.importing import import_trials
from myowave.data.trials import Trials
from myowave.diagnosis.comparison.compare import compare_models
from myowave.diagnosis.comparison.summary import summarize
from myowave.diagnosis.report.facts import verdict_facts
from myowave.diagnosis.report.figures import draw_diagnosis
from myowave.diagnosis.report.ladder import join_ladder, join_parameters
from myowave.diagnosis.report.motion import beside
from myowave.diagnosis.report.page import Story, write_page
from myowave.diagnosis.report.tables import TABLES, draft_source, predictions_table
from myowave.diagnosis.scoring import add_truth
from myowave.diagnosis.search import diagnose as search
from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.plotting import save
from myowave.settings import MeasuredDataset, Physics, Section, read_settings
from myowave.settings.data import force_and_length
from myowave.settings.files import read_yaml
from myowave.settings.keys import explain, unless_known

AnySection = TypeVar("AnySection", bound=Section)


class TrialsOfFiles(Trials):
    """Trials of one arm, as all of myowave takes them, with a way from files to them: `myowave.Trials`."""

    @classmethod
    def from_csv(cls, *files: str | Path, test: Sequence[str], dataset: str = "trials", **known: Any) -> Trials:
        """Trials of CSV files with columns `time_s`, `emg_MUSCLE` and `angle_rad` or `angle_deg`, one file per trial.

        Args:
            *files: paths, or patterns such as data/me/*.csv; a trial is named after its file without the ending.
            test: names of the trials kept for testing.
            **known: `conditions`, `constants` and `ignore_columns` of a measured dataset; its other settings say how to
                diagnose it, and are no part of trials.

        What is doubtful in them is warned of.

        Raises:
            ValueError: one line for each problem found in any of the files.
        """
        allowed = ("conditions", "constants", "ignore_columns")
        if problems := [line for name in known for line in unless_known("Trials.from_csv", name, allowed)]:
            raise ValueError("\n".join(problems))
        names = [str(file) if isinstance(file, Path) else file for file in files]
        block = _checked(MeasuredDataset, {"kind": "measured", "files": names, "test": test, **known})
        prepared, quality = import_trials(dataset, block)
        for line in in_sentences(quality):
            warnings.warn(line, stacklevel=2)
        return prepared.trials


@dataclass(frozen=True)
class Diagnosed:
    """Trials with what a diagnosis found in them."""

    trials: Trials
    physics: Physics
    diagnosis: search.Diagnosis

    @cached_property
    def verdict(self) -> dict[str, Any]:
        """What verdict.json holds; nothing is known of the truth."""
        compared = summarize(self.tables["torque"], self.tables["horizons"])
        return {**add_truth(verdict_facts(self.diagnosis), None), **compared, "command": ""}

    @cached_property
    def tables(self) -> dict[str, pd.DataFrame]:
        """The tables of results/diagnosis/DATASET by name, such as `ranking`, `parameters`, `torque`."""
        tables = {name: table(self.diagnosis) for name, table in TABLES.items()}
        build = partial(build_model, physics=self.physics)
        return tables | compare_models(self.trials, build, tables["parameters"], tables["errors"])

    def page(self, path: str | Path) -> Path:
        """Write the page that tells the verdict, which needs nothing else; returns where it is."""
        tables, predictions = self.tables, beside(predictions_table(self.diagnosis), "", None)
        ladder = join_ladder(tables["ladder"], [])
        figures = draw_diagnosis(tables | {"ladder": ladder}, predictions, self.verdict)
        with tempfile.TemporaryDirectory() as folder:
            images = {name: Path(folder, f"{name}.png") for name in figures}
            for name, figure in figures.items():
                save(figure, images[name])
            parameters, draft = join_parameters(self.verdict, []), draft_source(self.diagnosis)
            facts = {"ladder": ladder, "parameters": parameters, "ranking": tables["ranking"], "draft": draft}
            story = Story(verdict=self.verdict, predictions=predictions, images=images, **facts)
            Path(path).write_text(write_page(story), encoding="utf-8")
        return Path(path)


def diagnose(
    trials: Trials,
    arm: str | Path | Mapping[str, Any] = "paper",
    *,
    config: str | Path | Sequence[str | Path] = "config.yaml",
    say: Callable[[str], None] = lambda line: None,
) -> Diagnosed:
    """Find out which physical effects explain what a model of the arm misses; takes one to ten minutes.

    Args:
        trials: those kept for testing are predicted, and take no part in the verdict.
        arm: one of `physics.arms` in the settings, a YAML file of one, or a mapping of `muscles`, `joint` and the rest.
        config: the file of the settings, or several, each laid over those before; those of the diagnosis are taken
            from them.
        say: is told a line for each step.

    Raises:
        TypeError: for what are no trials.
        ValueError: for an arm that is not there, or settings and trials that do not go together.
    """
    files = [config] if isinstance(config, str | Path) else config
    settings = read_settings([Path(path) for path in files], "config=")
    if isinstance(arm, Mapping):
        physics = _checked(Physics, arm)
    elif str(arm) in settings.physics.arms:
        physics = settings.physics.of_arm(str(arm))
    elif Path(arm).is_file():
        physics = _checked(Physics, read_yaml(Path(arm), "muscles and joint"))
    else:
        raise ValueError(f"There is no arm or file {str(arm)!r}; the arms are {', '.join(settings.physics.arms)}.")
    if not isinstance(trials, Trials):
        raise TypeError(f"trials = {trials!r}: expected what myowave.Trials.from_csv returns.")
    base = build_model("base", physics)
    known = sorted({*trials.constants}.union(*trials.conditions.values()))
    if problems := [
        line for name in known for line in unless_known(trials.dataset, name, base.defaults, " in this arm")
    ]:
        raise ValueError("\n".join(problems))
    found = search.diagnose(
        trials,
        base,
        catalogue(physics.effect_files).values(),
        force_and_length(physics),
        settings.diagnosis,
        say,
    )
    return Diagnosed(trials, physics, found)


def _checked(section: type[AnySection], settings: Mapping[str, Any]) -> AnySection:
    """Settings as a section, or a ValueError with a line for each problem, as for those of a file."""
    try:
        return section.model_validate(settings)
    except ValidationError as error:
        raise ValueError("\n".join(explain(error, section))) from None
