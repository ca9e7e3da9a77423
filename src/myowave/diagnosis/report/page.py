"""A diagnosis as one page that needs nothing else: compare, where, which, add, watch.

The page is made of verdict.json, the tables and the pictures; the template stands with the workflow's captions.
"""

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from myowave.diagnosis.report.cells import ladder_cells, parameter_cells, proposal_cells, ranking_cells
from myowave.diagnosis.report.motion import list_motion
from myowave.diagnosis.report.tell import base_of, tell
from myowave.diagnosis.report.templates import fill
from myowave.diagnosis.report.words import GLOSSARY, explained, kind_of, named, titled

PIXELS = 1.9  # of a picture in one of the page


@dataclass(frozen=True)
class Story:
    """What a page is made of.

    Args:
        verdict: verdict.json.
        ladder, parameters: of `ladder.join_ladder` and `ladder.join_parameters`.
        ranking, proposals: the tables `ranking` and `next_trials` of `tables`.
        predictions: measured and simulated angle, of `tables.predictions_table`.
        images: {name: PNG file}; the page draws the overlay itself.
        draft: text of the drafted effect file.
    """

    verdict: Mapping[str, Any]
    ladder: pd.DataFrame
    parameters: pd.DataFrame
    ranking: pd.DataFrame
    proposals: pd.DataFrame
    predictions: pd.DataFrame
    images: Mapping[str, Path]
    draft: str


def write_page(story: Story, template: Path) -> str:
    """The page as HTML, pictures, styles and scripts inside.

    Args:
        template: verdict.html.j2; every text that comes from data is escaped.
    """
    verdict, titles, told = story.verdict, story.verdict["titles"], tell(story.verdict)
    assumed = story.parameters["assumed"].astype(bool)
    content = {
        "verdict": verdict,
        "told": told,
        "explained": partial(explained, titles=titles),
        "titled": partial(titled, titles=titles),
        "named": named,
        "glossary": GLOSSARY,
        "images": {name: inline(path) for name, path in story.images.items() if name != "overlay"},
        "widths": {name: shown_width(path) for name, path in story.images.items()},
        "motion": list_motion(story.predictions, verdict["model"], base_of(verdict)[1]["noise"]),
        "rankings": [(m, ranking_cells(rows)) for m, rows in story.ranking.groupby("model", sort=False)],
        "proposals": proposal_cells(story.proposals),
        "draft": story.draft if verdict["formula"] != "0" else "",
        "draft_is_news": kind_of(verdict).unexplained,
        "ladder": ladder_cells(story.ladder),
        "failed_seeds": bool(story.ladder["failed_seeds"].fillna("").any()),
        "parameters": parameter_cells(story.parameters[~assumed]),
        "assumed": parameter_cells(story.parameters[assumed]),
    }
    return fill(template, content)


def inline(path: Path) -> str:
    """A PNG file as a data URL."""
    return "data:image/png;base64," + base64.b64encode(Path(path).read_bytes()).decode()


def shown_width(path: Path) -> int:
    """Width of a picture on the page [px], so that letters are as large in all of them; from the header of the PNG."""
    return round(int.from_bytes(Path(path).read_bytes()[16:20]) / PIXELS)
