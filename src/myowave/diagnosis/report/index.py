"""One page over all datasets: verdicts, errors before and after, parameters; any of them side by side."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import yaml
from markupsafe import Markup

from myowave.diagnosis.comparison.names import EMG_ONLY, POSTURE
from myowave.diagnosis.report.contents import COMPARISON_NAMES, TABLE_NAMES
from myowave.diagnosis.report.numbers import degrees, interval, r2_text
from myowave.diagnosis.report.tell import Told, base_of, tell
from myowave.diagnosis.report.templates import fill
from myowave.diagnosis.report.words import BASE, explained, kind_of, named, titled

FILES = ("verdict.json", "watch.csv", *(f"{name}.csv" for name in (*COMPARISON_NAMES, *TABLE_NAMES)))


@dataclass(frozen=True)
class Entry:
    """A dataset of the index.

    Args:
        verdict: verdict.json.
        settings: of the dataset, without what is hidden in it; none where they are not known.
    """

    verdict: Mapping[str, Any]
    settings: Mapping[str, Any]

    @property
    def told(self) -> Told:
        """What is said of the verdict."""
        return tell(self.verdict)

    def errors(self, part: str) -> tuple[str, str]:
        """Of the base model, and of the model that was found; empty where nothing was added."""
        (base, first), found = base_of(self.verdict), self.verdict["model"]
        after = "" if found == base else degrees(self.verdict["rmse_deg"][found][part])
        return degrees(first[part]), after


def read_entry(folder: Path, settings: Mapping[str, Any]) -> Entry:
    """The entry of the dataset whose diagnosis is in a folder.

    Raises:
        ValueError: where its files are not there, or were written by another version.
    """
    try:
        verdict = json.loads((folder / "verdict.json").read_text(encoding="utf-8"))
        entry = Entry(verdict, settings)
        _row(entry), _facts(entry)
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise ValueError(
            f"{folder} is not whole, or another version's ({type(error).__name__}: {error}). Run its dataset again, or "
            "remove it."
        ) from None
    return entry


def read_entries(folders: Mapping[Path, Mapping[str, Any]], say: Callable[[str], None]) -> Iterator[Entry]:
    """Entries of diagnoses that other runs made, {folder: settings}; one that cannot be read is said and left out."""
    for folder, settings in folders.items():
        try:
            yield read_entry(folder, settings)
        except ValueError as error:
            say(f"Left out of the index: {error}")


def write_index(entries: Iterable[Entry], links: Sequence[tuple[str, str]], template: Path) -> str:
    """The page as HTML, styles and scripts inside; it stands beside the folder `diagnosis`.

    Args:
        links: (text, address) of what belongs to all datasets.
        template: index.html.j2; every text that comes from data is escaped.
    """
    entries = list(entries)
    facts = [_facts(entry) for entry in entries]
    kinds = dict.fromkeys(fact for of_one in facts for fact in of_one)
    return fill(
        template,
        {
            "explained": partial(explained, titles={}),
            "datasets": [_row(entry) for entry in entries],
            "names": [entry.verdict["dataset"] for entry in entries],
            "facts": [(fact, [of_one.get(fact, "") for of_one in facts]) for fact in kinds],
            "links": links,
            "base": BASE,
            "files": FILES,
        },
    )


def _row(entry: Entry) -> dict[str, Any]:
    """What the table of all datasets shows of one."""
    verdict = entry.verdict
    before, after = entry.errors("heldout")
    settings = {verdict["dataset"]: dict(entry.settings)}
    return {
        "name": verdict["dataset"],
        "kind": kind_of(verdict).label,
        "effects": _effects(verdict),
        "before": before,
        "after": after,
        "over": entry.told.over,
        "noise": _noise(entry),
        "parameters": _parameters(verdict, assumed=False),
        "constants": _parameters(verdict, assumed=True),
        "settings": yaml.safe_dump(settings, sort_keys=False, allow_unicode=True) if entry.settings else "",
    }


def _effects(verdict: Mapping[str, Any]) -> Markup:
    """The effects that are named, those of a class joined by `or`."""
    classes = {members[0]: members for members in verdict["alternatives"]}
    return Markup("; ").join(
        Markup(" or ").join(titled(name, verdict["titles"]) for name in classes.get(effect, [effect]))
        + " or something like it" * (effect in verdict["stand_ins"])
        for effect in verdict["effects"]
    )


def _noise(entry: Entry) -> str:
    """Noise of the angle, and what that of the recorded EMG makes of the motion, where it is there."""
    if not entry.verdict["emg_noise"]:
        return entry.told.noise
    moved = degrees(entry.verdict["emg_motion_deg"])
    return f"{entry.told.noise} of the angle; noise of the EMG moves the arm by {moved}"


def _parameters(verdict: Mapping[str, Any], *, assumed: bool) -> dict[str, str]:
    """Those that the settings ask for and those of effects, or the constants that nobody measured, with intervals."""
    return {
        name: interval(p["value"], p["se"], p["unit"], (p["low"], p["high"]))
        for name, p in verdict["parameters"][verdict["model"]].items()
        if p["assumed"] == assumed
    }


def _facts(entry: Entry) -> dict[str, str | Markup]:
    """What can be set side by side, in the order in which it is read."""
    verdict, found = entry.verdict, entry.verdict["model"]
    facts: dict[str, str | Markup] = {
        "verdict": kind_of(verdict).label,
        "what is missing": _effects(verdict),
        "model that was found": named(found),
        "predicted over": entry.told.over,
        "noise": _noise(entry),
    }
    for part, words in (("train", "training RMSE"), ("heldout", "held-out RMSE")):
        facts[f"{words}, base model"], facts[f"{words}, with what was found"] = entry.errors(part)
    r2, horizons = verdict["torque"]["r2"], verdict["horizons"]
    for name, words in ((POSTURE, POSTURE), (EMG_ONLY, EMG_ONLY), (found, "the model that was found")):
        if r2.get(name) is not None:
            facts[f"R2 of the torque, {words}"] = r2_text(r2[name])
    if found in horizons["rmse_deg"]:
        facts[f"RMSE {horizons['horizon_s']:g} s after a measured state"] = degrees(horizons["rmse_deg"][found])
    facts["where it fails"] = entry.told.where
    facts["record next"] = verdict["next_trial"]["trial"] if verdict["next_trial"] else ""
    return facts | {f"{name} (95 % interval)": text for name, text in _parameters(verdict, assumed=False).items()}
