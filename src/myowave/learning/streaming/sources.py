"""Where the lines of `myowave predict` come from: a file, or a trial of a dataset, prepared as by the import."""

import glob
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from io import TextIOWrapper
from pathlib import Path

import pandas as pd

from myowave.data.importing import Dataset, import_trials
from myowave.data.prepared import prepared_file, read_prepared
from myowave.data.readers.text import read_lines
from myowave.data.store import read_table
from myowave.data.trials import TIME, Trials
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.inputs import given_inputs
from myowave.learning.streaming.reading import LONGEST
from myowave.settings import MeasuredDataset, RecordedDataset
from myowave.settings.configuration import read_settings
from myowave.settings.files import require_regular
from myowave.settings.keys import did_you_mean


def file_lines(path: Path) -> list[str]:
    """Lines of CSV of a text, plain or packed (.gz), or of a Parquet file; a ValueError for something else."""
    require_regular(path)
    with open(path, "rb") as file:
        if file.read(4) == b"PAR1":
            return read_table(path)[0].to_csv(index=False).splitlines()
    try:
        return read_lines(path)
    except ValueError:
        raise ValueError(
            f"{path} holds no text. Expected CSV (as it is, or .gz) or Parquet; for another file of a recorder name "
            "its dataset and trial: --dataset NAME --trial TRIAL."
        ) from None


def standard_input() -> Iterator[str]:
    """Lines of CSV as they come; a ValueError where none can."""
    if not isinstance(sys.stdin, TextIOWrapper):
        raise ValueError("Standard input is closed: pipe lines of CSV into it, or name a file with --emg.")
    sys.stdin.reconfigure(errors="backslashreplace")  # the message on a line shows bytes that are no UTF-8
    # Each is read no further than a line may be long: what never ends would fill the memory.
    return iter(partial(sys.stdin.readline, LONGEST), "")


def find_checkpoint(dataset: str) -> Path:
    """The network of a dataset that is taken where none is named, or a ValueError: of the model without effects, with
    the fewest scales, not by the paper's method where there is another."""
    found = Path("results/learning", dataset).glob("*/*/*-scale/scale-0.pt")
    ordered = sorted(found, key=lambda p: (p.parts[-4].count("+"), p.parts[-2], p.parts[-3]))
    if not ordered:
        raise ValueError(
            f"There is no network of {dataset!r} in results/learning. Name the dataset under targets.datasets and run "
            "snakemake with all your files of settings; or name a network's file with --checkpoint."
        )
    alike = [path for path in ordered if path.parts[-4].count("+") == ordered[0].parts[-4].count("+")]
    return next((path for path in alike if Checkpoint.load(path).architecture.method != "paper"), ordered[0])


def trial_of(file: Path, dataset: str, config: Sequence[Path]) -> str | None:
    """The trial whose EMG is in a file, where the settings of a dataset name this very file; else None."""
    block = read_settings(config).data.datasets.get(dataset)
    if isinstance(block, MeasuredDataset):
        named = (Path(path).resolve() for pattern in block.files for path in glob.glob(pattern, recursive=True))
        return file.stem if file.resolve() in named else None
    channels = block.emg.values() if isinstance(block, RecordedDataset) else ()
    return next(filter(None, (channel.trial_of(file) for channel in channels)), None)


def trial_lines(dataset: str, trial: str, checkpoint: Checkpoint, config: Sequence[Path]) -> list[str]:
    """A trial as lines of CSV, at the rate of a network: of the trials in results/, else of its recordings, which are
    then prepared together with those of the dataset, so that the same EMG counts as 1. A ValueError for a dataset or
    trial that is not there, or that cannot be prepared."""
    trials = _trials_with(dataset, trial, config)
    one = trials.select([trial]).thinned(checkpoint.recipe["rate_hz"])
    if missing := [name for name in checkpoint.channels if name not in one.channels]:
        raise ValueError(
            f"{dataset}, trial {trial}: no {', '.join(missing)}, which the network takes; there are "
            f"{', '.join(one.channels)}. Name a network of this dataset with --checkpoint."
        )
    there = {*trials.signals, *trials.constants}.union(*trials.conditions.values())
    known = {name: value for name, value in checkpoint.architecture.known.items() if name in there}
    inputs = given_inputs(one, known)[0, : one.lengths[0]]
    table = pd.DataFrame(inputs, columns=[*one.channels, *known])
    table.insert(0, TIME, one.time[: len(table)])
    table["angle_rad"] = one.angle[0, : len(table)]
    return table.to_csv(index=False).splitlines()


def _trials_with(dataset: str, trial: str, config: Sequence[Path]) -> Trials:
    settings, names = read_settings(config).dataset(dataset), tuple[str, ...]()
    if prepared_file(dataset).exists():
        trials = read_prepared(dataset, settings, config)
        names = trials.names
        if trial in names:
            return trials
    if not isinstance(settings, Dataset):
        raise ValueError(f"{dataset} is simulated: only the trials in results/data/{dataset} can be predicted.")
    listed, more = (settings.trials if isinstance(settings, RecordedDataset) else settings.test), {}
    if trial not in listed:
        more = {"test": (*settings.test, trial)}  # so that EMG of 1 stays what it was
        if isinstance(settings, RecordedDataset):
            more |= {"trials": (*settings.trials, trial)}
    try:
        # Alone: nobody has said yet what is known of it, and a default must not stand for a load that it may have.
        return import_trials(dataset, settings.model_copy(update=more))[0].trials.select([trial])
    except (ValueError, OSError) as error:
        problem = next((line for line in str(error).splitlines() if not line.endswith(":")), "")
        raise ValueError(
            f"{dataset} has no trial {trial!r}{did_you_mean(trial, names) or '.'} There are "
            f"{', '.join(names) or 'none'}. Nor can it be imported, if it was recorded since: {problem}"
        ) from None
