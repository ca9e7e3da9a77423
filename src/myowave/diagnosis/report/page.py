"""A diagnosis as one page that needs nothing else: compare, where, which, add, watch.

The page is made of verdict.json, the tables and the pictures; the template stands with the workflow's captions.
"""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from myowave.diagnosis.report.cells import accuracy_cells, parameter_cells, ranking_cells
from myowave.diagnosis.report.contents import COMPARISON_NAMES, TABLE_NAMES
from myowave.diagnosis.report.motion import list_motion
from myowave.diagnosis.report.tell import is_quiet, leaves_more, tell
from myowave.diagnosis.report.templates import fill

PIXELS = 1.9  # of a picture in one of the page
FILES = ("verdict.json", "watch.csv", *(f"{name}.csv" for name in (*COMPARISON_NAMES, *TABLE_NAMES)))


@dataclass(frozen=True)
class Story:
    """What a page is made of."""

    verdict: Mapping[str, Any]  # verdict.json
    # ladder, parameters: of `ladder.join_ladder` and `ladder.join_parameters`
    ladder: pd.DataFrame
    parameters: pd.DataFrame
    ranking: pd.DataFrame  # the table `ranking` of `tables`
    predictions: pd.DataFrame  # measured and predicted angle, of `motion.beside`
    images: Mapping[str, Path]  # {name: PNG file}
    draft: str  # text of the drafted effect file
    doubts: Sequence[Mapping[str, str]] = ()  # `lines` of quality.json, what is doubtful in the recordings
    files: bool = False  # whether the page stands among the tables, with the index above it, and can link to them


def write_page(story: Story) -> str:
    """The page as HTML, pictures, styles and scripts inside."""
    verdict, found = story.verdict, story.verdict["model"]
    of_found = (story.parameters["model"] == found) & (story.parameters["source"] == "physics")
    assumed = story.parameters["assumed"].astype(bool)
    content = {
        "verdict": verdict,
        "told": tell(verdict, story.ladder),
        "quiet": is_quiet(verdict),
        "images": {name: inline(path) for name, path in story.images.items()},
        # From the header of the PNG, so that letters are as large in all of them [px].
        "widths": {n: round(int.from_bytes(path.read_bytes()[16:20]) / PIXELS) for n, path in story.images.items()},
        "motion": list_motion(story.predictions, verdict),
        "doubts": story.doubts,
        "accuracy": accuracy_cells(verdict, story.ladder),
        "rankings": [(m, ranking_cells(rows, verdict)) for m, rows in story.ranking.groupby("model", sort=False)],
        "draft": story.draft if leaves_more(verdict) and verdict["formula"] != "0" else "",
        "several": story.ladder["model"].nunique() > 1,
        "parameters": parameter_cells(story.parameters[of_found & ~assumed]),
        "assumed": parameter_cells(story.parameters[of_found & assumed]),
        "others": parameter_cells(story.parameters[~of_found & ~assumed], verdict["titles"]),
        "files": FILES if story.files else (),
    }
    return fill("verdict.html.j2", verdict["titles"], content)


def inline(path: Path) -> str:
    """A PNG file as a data URL."""
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode()
