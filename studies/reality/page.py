"""The page of the study: what was withheld and what was said, in words."""

import pandas as pd

from studies.reality.figures import error_before_after, said

HEAD = """# What it says where nobody here made the truth

Machines and persons that others recorded, with something known of them withheld. What is true is read by the scorer
alone. One setting came in after an answer had been seen: that a motor's gain is known to 10 % only. With the gain held
as told, a load that nobody put there was named beside or instead of the friction of servo and weight. Written by
`snakemake reality --cores 2`, whose table is `results/reality.csv`.

![What was withheld, what was said, and the error before and after.](reality.png)

"""
TAIL = """
- **graded**: *named*, all that is known to be missing; *class*, the same in classes of effects that these trials cannot
  tell apart; *honest*, no more than that something is missing, or a part of it; *silent*; *wrong*, a name of what is
  not there, or nothing else said to be missing where it is.
- **error**: of trials no fit has seen, simulated from their start to their end, with nothing added to the model, and
  with what is named or comes nearest.
- **a lasso on torque** keeps what it needs of all effects, each as it changes the torque at its usual strength
  (`scikit-learn`, penalty by cross-validation). **PySINDy** keeps terms of the acceleration, where it is installed
  (`studies/reality/requirements.txt`) and the arm has no muscles.
- **servo and weight**: [data/servo_pendulum](https://github.com/Rhoban/bam). Its authors find friction in proportion to
  the load on the gears; damping and dry friction are the usual, wrong answer. One of three gains is kept for testing.
- **pendulum in bearings**: [data/free_pendulum](https://github.com/dynamicslab/MultiArm-Pendulum). The second half of
  each swing is kept for testing.

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
            said(row).replace("\n", " "),
            _size(row),
            error_before_after(row),
            row["grade"],
            *(str(row[rival]).replace("_", " ") for rival in ("lasso", "pysindy")),
        ]
        for row in table.to_dict("records")
    ]
    lines = [heads, ["---"] * len(heads), *rows]
    return HEAD + "".join(f"| {' | '.join(cells)} |\n" for cells in lines) + TAIL


def _size(row: dict[str, float]) -> str:
    if pd.isna(row["size_true"]) or pd.isna(row["size_found"]):
        return ""
    return f"{row['size_found']:.2g}, {row['size_low']:.2g} to {row['size_high']:.2g} ({row['size_true']:.2g})"
