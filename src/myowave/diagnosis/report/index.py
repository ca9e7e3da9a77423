"""One page over all datasets: a picture, verdict, errors of muscle model and network, what to do next."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
import yaml
from markupsafe import Markup

from myowave.diagnosis.report.advice import base_of
from myowave.diagnosis.report.ladder import shown_network
from myowave.diagnosis.report.numbers import degrees, r2_text
from myowave.diagnosis.report.page import inline
from myowave.diagnosis.report.tell import tell
from myowave.diagnosis.report.templates import fill
from myowave.diagnosis.report.words import BASE, explained, kind_of, titled


@dataclass(frozen=True)
class Entry:
    """A dataset of the index.

    Args:
        verdict: verdict.json.
        ladder: of `ladder.join_ladder`.
        picture: PNG file of `figures.glance`; None where it is not there.
        settings: of the dataset, without what is hidden in it; none where they are not known.
    """

    verdict: Mapping[str, Any]
    ladder: pd.DataFrame
    picture: Path | None
    settings: Mapping[str, Any]


def read_entry(folder: Path, settings: Mapping[str, Any]) -> Entry:
    """The entry of the dataset whose diagnosis is in a folder.

    Raises:
        ValueError: where its files are not there, or were written by another version.
    """
    picture = folder.parents[1] / "figures" / folder.name / "diagnosis/glance.png"
    try:
        verdict = json.loads((folder / "verdict.json").read_text(encoding="utf-8"))
        ladder = pd.read_csv(folder / "watch.csv")
        entry = Entry(verdict, ladder, picture if picture.exists() else None, settings)
        _row(entry)
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
    """The page as HTML, pictures and styles inside; it stands beside the folder `diagnosis`.

    Args:
        links: (text, address) of what belongs to all datasets.
        template: index.html.j2; every text that comes from data is escaped.
    """
    rows = [_row(entry) for entry in entries]
    return fill(template, {"explained": partial(explained, titles={}), "datasets": rows, "links": links, "base": BASE})


def _row(entry: Entry) -> dict[str, Any]:
    """What the table of all datasets shows of one."""
    verdict = entry.verdict
    settings = {verdict["dataset"]: dict(entry.settings)}
    return {
        "name": verdict["dataset"],
        "image": inline(entry.picture) if entry.picture else "",
        "kind": kind_of(verdict).label,
        "effects": _effects(verdict),
        "model": _model(verdict),
        "network": _network(shown_network(entry.ladder, verdict["model"])),
        "todo": tell(verdict).todo,
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


def _model(verdict: Mapping[str, Any]) -> str:
    """Held-out error of the base model and of the one that was found, over whole trials or over what it follows."""
    (base, first), found, horizon = base_of(verdict), verdict["model"], verdict["horizon_s"]
    errors = degrees(first["heldout"]) + (
        f", {degrees(verdict['rmse_deg'][found]['heldout'])} with what was found" if found != base else ""
    )
    return errors if horizon is None else f"{errors} over {horizon:g} s from each measured state; it does not run free"


def _network(network: pd.Series | None) -> str:
    """Held-out error and R2 of the network over whole trials."""
    if network is None:
        return ""
    return f"{degrees(network['heldout_rmse_deg'])}, R2 {r2_text(network['heldout_r2'])}"
