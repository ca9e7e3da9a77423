"""One page over all datasets: a picture, verdict, errors of muscle model and network, what to do next."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import pandas as pd
import yaml

from myowave.data.json_files import read_json
from myowave.diagnosis.report.ladder import ERROR, shown_network
from myowave.diagnosis.report.page import inline
from myowave.diagnosis.report.tell import base_of, tell
from myowave.diagnosis.report.templates import fill


def write_index(
    folders: Mapping[Path, Mapping[str, Any]],
    links: Sequence[tuple[str, str]],
    say: Callable[[str], None] = lambda line: None,
) -> str:
    """The page as HTML, pictures and styles inside; it stands beside the folder `diagnosis`.

    Args:
        folders: of diagnoses, each with the settings of its dataset without what is hidden in it, none where they are
            not known. One that is not whole, or another version's, is said and left out.
        links: (text, address) of what belongs to all datasets.
    """
    rows = []
    for folder, settings in folders.items():
        try:
            rows.append(_row(folder, settings))
        except (OSError, ValueError, LookupError, TypeError, AttributeError, jinja2.UndefinedError) as error:
            say(
                f"Left out of the index: {folder} is not whole, or another version's ({type(error).__name__}: "
                f"{error}). Run its dataset again, or remove it."
            )
    return fill("index.html.j2", {}, {"datasets": rows, "links": links})


def _row(folder: Path, settings: Mapping[str, Any]) -> dict[str, Any]:
    """What the table of all datasets shows of one."""
    verdict = read_json(folder / "verdict.json")
    ladder, name, found = pd.read_csv(folder / "watch.csv"), verdict["dataset"], verdict["model"]
    picture = folder.parents[1] / "figures" / folder.name / "diagnosis/glance.png"
    network = shown_network(ladder, found)
    models = dict.fromkeys((base_of(verdict)[0], found))
    return {
        "name": name,
        "about": settings.get("about", ""),
        "image": inline(picture) if picture.exists() else "",
        "told": tell(verdict, ladder),
        "missing": verdict["effects"],
        "errors": [verdict["rmse_deg"][model]["heldout"] for model in models],
        "horizon_s": verdict["horizon_s"],
        "network": None if network is None else (network[ERROR], network["heldout_r2"]),
        "settings": yaml.safe_dump({name: dict(settings)}, sort_keys=False, allow_unicode=True) if settings else "",
    }
