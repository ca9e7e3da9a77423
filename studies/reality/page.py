"""The page of the study: what was withheld and what was said, in words."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from myowave.diagnosis.causes import CAUSE_TITLES, OUTSIDE
from myowave.physics.effects import catalogue
from studies.shared import markdown

RUNAWAY = 60.0  # deg; what misses more follows no longer
PLAIN = {"adequate": "nothing", "unknown": "something unknown", "undecidable": "cannot be told"}
HEAD = """# What it says where nobody here made the truth

Machines and a person that others recorded, and an arm that another program moves, with something known of them
withheld. What is true is read by the scorer alone. One setting came in after an answer had been seen: that a motor's
gain is known to 10 % only. With the gain held as told, a load that nobody put there was named beside or instead of the
friction of servo and weight. How what changed is weighed was chosen with the person's seven rows in sight, so none of
them is a test; [what changed](changed.md) has fresh ones. And tendons got a toe, and lags that change with the
activation, as OpenSim has them, after the first row of Arm26 had been answered wrongly; that unusual constants are told
beside named effects, and count, came after the second. Dry friction that is largest near rest came into the catalogue
after the servo that is off had been answered wrongly, and so did the search that meets it there. Written by
`snakemake reality --cores 2`, whose table is `results/reality.csv`.

![What was withheld, what was said, and the error before and after.](reality.png)

"""
TAIL = """

- **graded**: *named*, all that is known to be missing; *class*, the same in classes of effects that these trials cannot
  tell apart, or for which something like them that the catalogue lacks would do as well; *honest*, no more than that
  something is missing, or a part of it, or that unusual constants may hide it (the effects that explain them are in the
  table's column `masked`); *silent*; *wrong*, a name of what is not there, or nothing else said to be missing where it
  is.
- **error**: of trials no fit has seen, simulated from their start to their end, with nothing added to the model, and
  with what is named or comes nearest; none where only the torques of two groups were compared.
- **a lasso on torque** keeps what it needs of all effects, each as it changes the torque at its usual strength
  (`scikit-learn`, penalty by cross-validation). **PySINDy** keeps terms of the acceleration, where it is installed
  (`studies/reality/requirements.txt`) and the arm has no muscles.
- **servo and weight**: [data/servo_pendulum](https://github.com/Rhoban/bam). Its authors find friction in proportion to
  the load on the gears; damping and dry friction are the usual, wrong answer. One of three gains is kept for testing.
  With the motor off, dry friction with drag is likelier than with damping by no more than 3 nats, and by less than 2
  than damping with a friction that is largest near rest, which its authors have: these drops do not tell them apart.
- **pendulum in bearings**: [data/free_pendulum](https://github.com/dynamicslab/MultiArm-Pendulum). The second half of
  each swing is kept for testing.
- **a person**: [data/elbow_curls](https://github.com/jiruifu-jerry0219/UpperLimbEstimator), asked what changed
  between trials with one dumbbell and with another, or with what was done to the EMG by hand. The three silent rows are
  smaller than trials of this person differ anyway: [what is missed, and why](changed.md).
- **OpenSim's Arm26**: `data/arm26/trials`, simulated by OpenSim 4.6 (`studies/reality/arm26.py`). Its activation lags,
  its tendons stretch and its curves are Thelen's: all of that counts as missing, even what the noise of 0.5 deg hides.
  One of four trials is kept for testing.

A case is a dataset and a line in `studies/reality/settings.yaml`, and what is true of it in
`studies/reality/truth.yaml`.
"""


def write_page(table: pd.DataFrame) -> str:
    """The page as Markdown.

    Args:
        table: as `score.score_cases` gives it.
    """
    heads = ["what moves", "not told", "said", "size (true)", "error [deg]", "graded", "lasso on torque", "PySINDy"]
    rows = [
        [
            f"{row['system']} ({row['kind']})",
            row["withheld"],
            " ".join(said(row).split()),
            _size(row),
            error_before_after(row),
            row["grade"],
            *(str(row[rival]).replace("_", " ") for rival in ("lasso", "pysindy")),
        ]
        for row in table.to_dict("records")
    ]
    return HEAD + markdown(heads, rows) + TAIL


def said(row: Mapping[str, Any]) -> str:
    """The answer of a row in few words, in lines short enough for the picture."""
    verdict, names, classes = row["verdict"], row["names"], row["class"]
    titles = CAUSE_TITLES | {name: effect.title for name, effect in catalogue().items()}
    if not names:
        near = ",\n".join(titles[name] for name in filter(None, row["nearest"].split(", ")))
        return PLAIN.get(verdict, verdict) + f"\n(nearest: {near})" * bool(near)

    groups = [one.split(" or ") for one in classes.split("; ")]

    def told(name: str) -> str:
        others = {member for members in groups if name in members for member in members} - {name, OUTSIDE}
        return titles.get(name, name.replace("_", " ")) + (
            f"\n   (or {len(others)} other{'s' * (len(others) > 1)})" if others else ""
        )

    listed, hidden = names.split(", "), [name for name in row["masked"].split(", ") if name]
    like = f"\nor something like {'them' if listed[1:] else 'it'}" if any(OUTSIDE in g for g in groups) else ""
    more = "," * bool(like) + "\nand something else" if verdict == "partial" else ""
    hides = f"\nand perhaps one of {len(hidden)} (unusual constants)" if hidden else ""
    return ",\n".join(map(told, listed)) + like + more + hides


def error_before_after(row: Mapping[str, Any]) -> str:
    """Both errors of a row [deg], one where they are the same; nothing where there are none."""
    errors = [row[key] for key in ("error_before", "error_after")]
    told = [f"{error:.2g}" if error < RUNAWAY else "runs away" for error in errors if pd.notna(error)]
    return " → ".join(dict.fromkeys(told))


def _size(row: Mapping[str, Any]) -> str:
    if pd.isna(row["size_true"]) or pd.isna(row["size_found"]):
        return ""
    return f"{row['size_found']:.2g}, {row['size_low']:.2g} to {row['size_high']:.2g} ({row['size_true']:.2g})"
