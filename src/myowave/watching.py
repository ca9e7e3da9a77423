"""A recording session that ends in a verdict: trials are read as they appear, and what they leave open comes next.

Import, the fit to torque, the comparison and `changed` are those of the rules. Nothing is written.
"""

import glob
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from myowave.data.checks.finding import Finding, in_sentences, report
from myowave.data.importing import Dataset, import_trials
from myowave.data.reading import TIDY_ENDINGS
from myowave.data.trials import Trials
from myowave.diagnosis.changed.ask import SIDE_BY_SIDE, what_changed
from myowave.diagnosis.comparison.baselines import POSTURE, POSTURE_LOAD
from myowave.diagnosis.comparison.torque import compare_torque
from myowave.diagnosis.report.change import changed_facts, tell_change
from myowave.diagnosis.report.tell import AS_GOOD
from myowave.diagnosis.report.templates import of_muscles, with_unit
from myowave.identification.along import Along
from myowave.identification.free_parameters import free_parameters
from myowave.identification.record import make_record
from myowave.identification.stages import attempt_fit
from myowave.identification.torque import TorqueFit, fit_torque
from myowave.models import build_model
from myowave.physics.constants import constant_of
from myowave.physics.effects import catalogue
from myowave.physics.model import Model
from myowave.physics.muscle import EXTENSOR, FLEXOR
from myowave.settings import MeasuredDataset, Settings, read_settings
from myowave.settings.recording import TRIAL
from myowave.starting.block import LOAD, kind_of, load_of

POLL_S = 1.0
KNOWN = 0.25  # of a strength: an interval of 95 % that reaches no further decides it
FEWEST = 2  # trials of a group, before which no name is believed
LOADING = {  # what shows how strong muscles of a side are
    FLEXOR: "hold 2 kg at 90 deg for 5 s, three times, faster to it each time; call the trial 2kg_1",
    EXTENSOR: "upper arm straight up beside the head, 1 kg in the hand: stretch the elbow and bend it, three times, "
    "faster each time; call the trial up_1 and write conditions: {up_1: {load: 1, tilt: 3.14}}",
}
Seen = dict[str, list[tuple[Path, int, int]]]
"""Files of each trial, and those of the settings, with their sizes and times of change."""


class Question(NamedTuple):
    """What is `asked`, what trials say to it so far, and the trial to record, which is empty where it is decided."""

    asked: str
    found: str
    record: str = ""


def watch_session(dataset: str, config: Sequence[Path], folder: Path) -> Iterator[str]:
    """Read trials as they appear in a folder, without end, and yield lines on what is doubtful, what is decided and
    what comes next.

    Args:
        dataset: its block says where files are and what is known of trials; it is read again whenever one appears.
        folder: where trials appear: tidy files of any name, raw ones where the patterns of the block have them.

    Raises:
        ValueError: if there is no such dataset or folder, or the settings are not right in the beginning.
    """
    if not folder.is_dir():
        raise ValueError(f"{folder}: no such folder; make it, and let the recorder write into it.")
    settings, taken, told = _settings(config, dataset), list[str](), set[tuple[str, str, str]]()
    before, seen = _look(folder, _block(settings, dataset), config), Seen()
    yield f"{len(before)} trials are in {folder}; each new one is read as it appears. Ctrl-C ends this."
    while True:
        time.sleep(POLL_S)
        there = _look(folder, _block(settings, dataset), config)
        whole = [name for name in there if before.get(name) == there[name]]  # nobody wrote since the last look
        fresh = [name for name in whole if seen.get(name) != there[name]]
        before, seen = there, {name: there[name] for name in whole}
        taken = [name for name in taken if name in whole and name not in fresh]
        if not fresh:
            continue
        try:
            settings = _settings(config, dataset)
        except (ValueError, OSError) as error:
            yield f"The settings stay what they were until this is right: {error}"
        imported, tried = None, [fresh]
        for names in tried:  # all at once, and each by itself where that fails
            try:
                imported = import_named([*taken, *names], folder, settings, dataset)
                taken += names
            except (ValueError, OSError) as error:
                if len(names) > 1:
                    tried += [[name] for name in names]
                else:
                    yield f"{names[0]} is left out until its files or the settings change: {error}"
        if imported is None:
            continue
        trials, quality = imported
        yield f"\n{len(trials.names)} trials: {', '.join(trials.names)}"
        yield from _doubts(quality, fresh, told)
        try:
            yield from _answers(ask(trials, settings, dataset))
        except (ValueError, OSError) as error:
            yield f"Nothing can be asked of these: {error}"


def _doubts(quality: Mapping[str, Any], fresh: Sequence[str], told: set[tuple[str, str, str]]) -> Iterator[str]:
    """Lines of warnings about fresh trials, and of those about others or the session that were not `told` yet."""
    found = {(one["trial"], one["signal"], one["check"]): Finding(**one) for one in quality["findings"]}
    new = [one for about, one in found.items() if about[0] in fresh or about not in told]
    told.update(found)
    yield from (f"  doubtful: {line}" for line in in_sentences(report(quality["dataset"], new, {})))


def _answers(questions: Sequence[Question]) -> Iterator[str]:
    yield from (f"  {'open' if one.record else 'decided'}: {one.asked} {one.found}" for one in questions)
    first = next((one for one in questions if one.record), None)
    yield f"Next: {first.record}. It decides: {first.asked}" if first else "Nothing is open: run the diagnosis."


def _settings(config: Sequence[Path], dataset: str) -> Settings:
    """The settings, in which there is a dataset whose trials can appear."""
    settings = read_settings(config)
    _block(settings, dataset)
    return settings


def _block(settings: Settings, dataset: str) -> Dataset:
    block = settings.dataset(dataset)
    if not isinstance(block, Dataset):
        raise ValueError(f"{dataset} is simulated; name a recorded or measured dataset, whose trials can appear.")
    return block


def _look(folder: Path, block: Dataset, config: Sequence[Path]) -> Seen:
    """The trials all of whose files are in a folder, the oldest first."""
    there = Seen()
    for name, patterns in _patterns(folder, block).items():
        found = [[Path(path) for path in glob.glob(pattern, recursive=True)] for pattern in patterns]
        paths = [path for several in found for path in several]
        if all(found) and all(folder.resolve() in path.resolve().parents for path in paths):
            stats = [(path, path.stat()) for path in (*paths, *config) if path.exists()]
            there[name] = [(path, stat.st_size, stat.st_mtime_ns) for path, stat in stats]

    def appeared(name: str) -> int:
        return max(changed for path, _, changed in there[name] if path not in config)  # which change by themselves

    return {name: there[name] for name in sorted(there, key=appeared)}


def _patterns(folder: Path, block: Dataset) -> dict[str, tuple[str, ...]]:
    """Trials of which there is any file, with the patterns of all of theirs."""
    if isinstance(block, MeasuredDataset):
        tidy = [path for path in folder.glob("[!.]*") if path.suffix.lower() in TIDY_ENDINGS]
        return {path.stem: (glob.escape(str(path)),) for path in tidy}
    angles = glob.glob(block.angle.file.replace(TRIAL, "*"), recursive=True)
    found = (block.angle.trial_of(Path(path)) for path in angles)
    names = {name for name in found if name} - {*block.mvc}
    return {name: block.model_copy(update={"trials": (name,), "mvc": ()}).files for name in names}


def import_named(
    names: Sequence[str], folder: Path, settings: Settings, dataset: str
) -> tuple[Trials, Mapping[str, Any]]:
    """The trials of these names, all for training, and the report on them; a ValueError if one cannot be read, or
    nobody says what the hand holds in it."""
    block = _block(settings, dataset)
    known = {name: _known_of(name, block) for name in names}
    update: dict[str, Any] = {"test": (), "changed": None, "conditions": known}
    if isinstance(block, MeasuredDataset):
        patterns = _patterns(folder, block)
        update["files"] = tuple(pattern for name in names for pattern in patterns[name])
    else:
        update["trials"] = tuple(names)
    arm = settings.physics_of(dataset)
    prepared, quality = import_trials(dataset, block.model_copy(update=update), arm.tables, arm.sides)
    return prepared.trials, quality


def _known_of(name: str, block: Dataset) -> Mapping[str, float]:
    """What is known of a trial: by its own name, alike of all others of its kind, or by a name such as 2kg_1."""
    alike = [known for one, known in block.conditions.items() if kind_of(one) == kind_of(name)]
    by_name = {"load": float(load.replace(",", "."))} if (load := load_of(name)) else {}
    known = block.conditions.get(name, alike[0] if alike and all(one == alike[0] for one in alike) else by_name)
    if not known and (LOAD.search(name) or any("load" in one for one in block.conditions.values())):
        raise ValueError(f"what does the hand hold? Call it 2kg_1, or write conditions: {{{name}: {{load: 2}}}}.")
    return known


def ask(trials: Trials, settings: Settings, dataset: str) -> list[Question]:
    """What the trials decide; the last one is foretold by those before it."""
    foretell, newest = "Do EMG and muscles foretell the torque of a new trial?", trials.names[-1]
    base = build_model("base", settings.physics_of(dataset))
    if len(trials.names) == 1:
        return [Question(foretell, "There is one trial.", "the same once more")]
    record = make_record(replace(trials, test=(newest,)), base)
    scatter = settings.diagnosis_of(dataset).scatter
    free = free_parameters(base, _block(settings, dataset).identify, record.known, scatter)
    torque = attempt_fit(lambda: fit_torque(base, record.train, free))
    if torque is None:
        return [Question(foretell, "The trials are too short.", "the same for 20 s, without a pause")]
    values = {p.name: float(value) for p, value in zip(torque.free, torque.values, strict=True)}
    table = compare_torque([Along(base, record, values)])
    r2 = table[table["held_out"]].set_index("model")["r2"]
    rival = max(r2[POSTURE], r2.get(POSTURE_LOAD, -np.inf))
    found = f"{newest}: R² {r2[base.name]:.2f} by EMG and muscles, {rival:.2f} by posture, speed and load."
    again = f"one more as {newest}; if it stays so, look at electrodes, loads and synchronisation"
    foretold = r2[base.name] > max(rival - AS_GOOD, 0.0)
    return [
        *_strengths(torque, base),
        Question(foretell, found, "" if foretold else again),
        *_changes(trials, settings, dataset, base),
    ]


def _strengths(torque: TorqueFit, base: Model) -> Iterator[Question]:
    """How strong is each group of muscles, or muscle without one? A value near a bound is none."""
    sides = {f"strength_{m.group}" if m.group else f"f0_{m.name}": m.side for m in base.muscles}
    for free, value, error in zip(torque.free, torque.values, np.sqrt(np.diag(torque.covariance)), strict=True):
        if free.name in sides:
            low, high = value - 2 * error, value + 2 * error
            decided = free.low < low and high < free.high and 2 * error < KNOWN * value
            unit = with_unit(constant_of(free.name).unit)
            found = f"{value:.3g}{unit} ({max(low, free.low):.3g} to {min(high, free.high):.3g}{unit})."
            asked = of_muscles(f"Strength of {free.name.partition('_')[2]}?")
            yield Question(asked, found, "" if decided else LOADING[sides[free.name]])


def _changes(trials: Trials, settings: Settings, dataset: str, base: Model) -> Iterator[Question]:
    """What changed between the two groups of the settings? A trial belongs to that which lists it or, where the groups
    are of different kinds, one of its kind."""
    groups = _block(settings, dataset).changed
    if groups is None:
        return
    asked = "What changed between the two groups?"
    kinds = [{kind_of(name) for name in listed} for listed in (groups.reference, groups.against)]
    mixed = not kinds[0].isdisjoint(kinds[1])
    sides = (groups.reference, groups.against) if mixed else kinds
    reference, against = (tuple(n for n in trials.names if (n if mixed else kind_of(n)) in side) for side in sides)
    more = f"one more as {(groups.reference if len(reference) <= len(against) else groups.against)[0]}"
    more += ", and name it under changed" * mixed
    if min(len(reference), len(against)) < FEWEST:
        yield Question(asked, f"{len(reference)} trials of the first, {len(against)} of the second.", more)
        return
    effects = catalogue(settings.physics_of(dataset).effect_files).values()
    alike = groups.model_copy(update={"reference": reference, "against": against})
    scatter = settings.diagnosis_of(dataset).scatter
    answer = what_changed(trials, base, effects, alike, scatter, workers=SIDE_BY_SIDE)
    sure = answer.names and answer.control is not None and not answer.control.names
    yield Question(asked, " ".join(tell_change(changed_facts(dataset, answer))[:2]), "" if sure else more)
