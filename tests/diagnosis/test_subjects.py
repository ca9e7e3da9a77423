"""Verdicts of many subjects come into one table and one picture."""

import json

from myowave.diagnosis.subjects.figures import draw_subjects
from myowave.diagnosis.subjects.table import tabulate_subjects


def verdict(subject: str, effects: list[str], errors: list[float]) -> dict:
    models = ["+".join(["base", *effects[:i]]) for i in range(len(errors))]
    return {
        "dataset": subject,
        "verdict": "named" if effects else "adequate",
        "effects": effects,
        "model": models[-1],
        "rmse_deg": {m: {"train": e, "heldout": 2 * e, "noise": 1.0} for m, e in zip(models, errors, strict=True)},
        "parameters": {m: {"f0_Bi": {"value": 300.0 + e, "se": 1.0}} for m, e in zip(models, errors, strict=True)},
    }


def test_all_subjects_are_in_one_table_and_picture(tmp_path):
    paths = []
    for i, found in enumerate((verdict("ann", ["tilt"], [3.0, 1.0]), verdict("bob", [], [1.1]))):
        paths.append(tmp_path / f"{i}.json")
        paths[-1].write_text(json.dumps(found))
    table = tabulate_subjects(paths)
    assert table[["subject", "model"]].to_numpy().tolist() == [["ann", "base"], ["ann", "base+tilt"], ["bob", "base"]]
    assert table["heldout_rmse_deg"].tolist() == [6.0, 2.0, 2.2]
    figure = draw_subjects(table)
    assert "2 subjects" in figure.get_suptitle() and figure.get_suptitle().endswith("smaller in 1")
    shown = {axis.get_title("left") or axis.get_title(): axis for axis in figure.axes if axis.get_visible()}
    assert [line.get_ydata().tolist() for line in shown["error"].lines] == [[6.0, 2.2], [2.0, 2.2]]
