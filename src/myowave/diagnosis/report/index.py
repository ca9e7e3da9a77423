"""One page over all datasets: verdicts, errors before and after, parameters; any of them side by side."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from markupsafe import Markup

from myowave.diagnosis.comparison.names import EMG_ONLY, POSTURE
from myowave.diagnosis.comparison.telling import explained, missed, named_horizon, r2_text
from myowave.diagnosis.report.cells import ANYWHERE, Z95, interval_of, named
from myowave.diagnosis.report.contents import COMPARISON_NAMES, TABLE_NAMES
from myowave.diagnosis.report.templates import fill
from myowave.diagnosis.report.words import BASE, degrees, kind_of, noise, tell, titled

FILES = ("verdict.json", "watch.csv", *(f"{name}.csv" for name in (*COMPARISON_NAMES, *TABLE_NAMES)))


@dataclass(frozen=True)
class Entry:
    """A dataset of the index.

    Args:
        verdict: verdict.json.
        parameters: parameters.csv, columns model, parameter, value, se, low, high, unit, assumed.
        torque, horizons: of `comparison.compare.compare_models`.
        settings: of the dataset, without what is hidden in it; none where they are not known.
    """

    verdict: Mapping[str, Any]
    parameters: pd.DataFrame
    torque: pd.DataFrame
    horizons: pd.DataFrame
    settings: Mapping[str, Any]

    @property
    def name(self) -> str:
        return str(self.verdict["dataset"])

    @property
    def before(self) -> Mapping[str, float]:
        """Errors [deg] of the model without effects."""
        errors: Mapping[str, float] = next(iter(self.verdict["rmse_deg"].values()))
        return errors

    @property
    def after(self) -> Mapping[str, float] | None:
        """Errors [deg] of the model that was found; none where nothing was added."""
        found = self.verdict["model"]
        errors: Mapping[str, Mapping[str, float]] = self.verdict["rmse_deg"]
        return None if found == next(iter(errors)) else errors[found]


def read_entry(folder: Path, settings: Mapping[str, Any]) -> Entry:
    """The entry of the dataset whose diagnosis is in a folder.

    Raises:
        ValueError: where its files are not there, or were written by another version.
    """
    try:
        entry = Entry(
            verdict=json.loads((folder / "verdict.json").read_text(encoding="utf-8")),
            parameters=pd.read_csv(folder / "parameters.csv"),
            torque=pd.read_csv(folder / "torque.csv"),
            horizons=pd.read_csv(folder / "horizons.csv"),
            settings=settings,
        )
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
            "tell": partial(tell, titles={}),
            "datasets": [_row(entry) for entry in entries],
            "names": [entry.name for entry in entries],
            "facts": [(fact, [of_one.get(fact, "") for of_one in facts]) for fact in kinds],
            "links": links,
            "base": BASE,
            "files": FILES,
        },
    )


def interval(value: float, se: float | None, unit: str, bounds: tuple[float, float] = ANYWHERE) -> str:
    """A parameter with its 95 % interval, within its bounds; the value alone where it has no standard error."""
    of = "" if unit in ("-", "") else f" {unit}"
    if se is None or pd.isna(se) or se <= 0:
        return f"{value:.4g}{of}"
    digits = int(np.clip(1 - np.floor(np.log10(Z95 * se)), 0, 7))
    ends = interval_of(value, se, bounds)
    if ends == bounds:
        return f"{value:.4g}{of} (not known: anywhere from {bounds[0]:.4g} to {bounds[1]:.4g})"
    middle, low, high = (f"{round(end, digits) + 0.0:.{digits}f}" for end in (np.clip(value, *bounds), *ends))
    return f"{middle}{of} ({low} to {high})" if low != high else f"{value:.4g}{of}"


def _row(entry: Entry) -> dict[str, Any]:
    """What the table of all datasets shows of one."""
    verdict = entry.verdict
    return {
        "name": entry.name,
        "kind": kind_of(verdict).label,
        "effects": _effects(verdict),
        "before": degrees(entry.before["heldout"]),
        "after": degrees(entry.after["heldout"]) if entry.after else "",
        "over": _reach(verdict),
        "noise": _noise(verdict),
        "parameters": _parameters(entry, verdict["model"], assumed=False),
        "constants": _parameters(entry, verdict["model"], assumed=True),
        "settings": _written(entry) if entry.settings else "",
    }


def _written(entry: Entry) -> str:
    return yaml.safe_dump({entry.name: dict(entry.settings)}, sort_keys=False, allow_unicode=True)


def _effects(verdict: Mapping[str, Any]) -> Markup:
    """The effects that are named, those of a class joined by `or`."""
    classes = {members[0]: members for members in verdict["alternatives"]}
    return Markup("; ").join(
        Markup(" or ").join(titled(name, verdict["titles"]) for name in classes.get(effect, [effect]))
        + " or something like it" * (effect in verdict["stand_ins"])
        for effect in verdict["effects"]
    )


def _noise(verdict: Mapping[str, Any]) -> str:
    """Noise of the angle, and what that of the recorded EMG makes of the motion, where it is there."""
    if not verdict.get("emg_noise"):
        return noise(verdict)
    return f"{noise(verdict)} of the angle; noise of the EMG moves the arm by {degrees(verdict['emg_motion_deg'])}"


def _reach(verdict: Mapping[str, Any]) -> str:
    horizon = verdict.get("horizon_s")
    return "whole trials" if horizon is None else f"all of the {horizon:g} s after a measured state"


def _parameters(entry: Entry, model: str, *, assumed: bool) -> dict[str, str]:
    """Those that the settings ask for and those of effects, or the constants that nobody measured, with intervals."""
    rows = entry.parameters[(entry.parameters["model"] == model) & (entry.parameters["assumed"] == assumed)]
    return {
        r.parameter: interval(r.value, r.se, "" if pd.isna(r.unit) else r.unit, (r.low, r.high))
        for r in rows.itertuples()
    }


def _facts(entry: Entry) -> dict[str, str | Markup]:
    """What can be set side by side, in the order in which it is read."""
    verdict, found = entry.verdict, entry.verdict["model"]
    facts: dict[str, str | Markup] = {
        "verdict": kind_of(verdict).label,
        "what is missing": _effects(verdict),
        "model that was found": named(found),
        "predicted over": _reach(verdict),
        "noise": _noise(verdict),
    }
    for part, words in (("train", "training RMSE"), ("heldout", "held-out RMSE")):
        facts[f"{words}, base model"] = degrees(entry.before[part])
        facts[f"{words}, with what was found"] = degrees(entry.after[part]) if entry.after else ""
    facts |= _comparison(entry, found)
    facts["where it fails"] = str(verdict["where"])
    facts["record next"] = str(verdict["next_trial"]["trial"]) if verdict.get("next_trial") else ""
    return facts | {f"{name} (95 % interval)": text for name, text in _parameters(entry, found, assumed=False).items()}


def _comparison(entry: Entry, found: str) -> dict[str, str]:
    """Held-out torque explained and error at the short horizon, beside predictors without a model of the arm."""
    r2 = explained(entry.torque)[1]
    facts = {}
    for name, words in ((POSTURE, POSTURE), (EMG_ONLY, EMG_ONLY), (found, "the model that was found")):
        if not pd.isna(r2.get(name, np.nan)):
            facts[f"R2 of the torque, {words}"] = r2_text(r2[name])
    rmse = missed(entry.horizons)[1]
    horizon = named_horizon(rmse)
    if horizon is not None and found in rmse.index:
        facts[f"RMSE {horizon:g} s after a measured state"] = degrees(rmse.loc[found, horizon])
    return facts
