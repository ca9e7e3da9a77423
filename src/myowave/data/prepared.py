"""Trials that the workflow prepared, for commands, which read the settings themselves and may find others by then."""

import shlex
from collections.abc import Sequence
from pathlib import Path

from myowave.data.importing import Dataset, known_constants, reading_settings
from myowave.data.store import read_trials
from myowave.data.trials import Trials
from myowave.settings import SimulatedDataset


def prepared_file(dataset: str) -> Path:
    """Where the workflow puts the trials of a dataset."""
    return Path("results/data", dataset, "trials.parquet")


def read_prepared(dataset: str, settings: Dataset | SimulatedDataset, config: Sequence[Path]) -> Trials:
    """The prepared trials of a dataset; a ValueError with the command that makes them if there are none, or if the
    settings, read from the files `config`, now have other constants, conditions or test trials, or read otherwise."""
    path = prepared_file(dataset)
    # The target comes first: --configfile takes all words that follow it.
    command = shlex.join(["snakemake", "--cores", "1", str(path), "--configfile", *map(str, config)])
    if not path.exists():
        raise ValueError(f"{path}: no such file. Make it with: {command}")
    trials = read_trials(path)
    # Trials that the settings name since then are left aside: they can be predicted before they are prepared.
    found = {"test": {*trials.test}, "constants": trials.constants}
    expected = {"test": {*settings.test} & {*trials.names}, "constants": known_constants(settings)}
    for name in trials.names:
        known = trials.conditions.get(name, {}).items()
        found[f"conditions.{name}"] = {key: value for key, value in known if key not in trials.over_time}
        expected[f"conditions.{name}"] = settings.conditions.get(name, {})
    expected |= reading_settings(settings, trials.names)
    found = expected | found | trials.provenance.get("settings", {})
    if other := [key for key in expected if found[key] != expected[key]]:
        raise ValueError(
            f"{path}: prepared with other {', '.join(other)} than data.datasets.{dataset} has now. Make it anew with: "
            f"{command}"
        )
    return trials
