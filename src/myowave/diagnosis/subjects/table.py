"""One table of many subjects: what was found missing, and the parameters of each fitted model."""

import json
from collections.abc import Sequence
from pathlib import Path

import pandas as pd


def tabulate_subjects(verdicts: Sequence[str | Path]) -> pd.DataFrame:
    """A row a subject and fitted model, the base first.

    Args:
        verdicts: verdict.json of each subject.

    Returns:
        Columns subject, verdict, effects (joined by +), model, found (whether it is the one that was found),
        train_rmse_deg, heldout_rmse_deg, noise_deg, and each parameter with its standard error as `{name}` and
        `{name}_se`, SI units; empty where a model has no such one.
    """
    rows = []
    for path in verdicts:
        verdict = json.loads(Path(path).read_text(encoding="utf-8"))
        for model, errors in verdict["rmse_deg"].items():
            row = {
                "subject": verdict["dataset"],
                "verdict": verdict["verdict"],
                "effects": "+".join(verdict["effects"]),
                "model": model,
                "found": model == verdict["model"],
                "train_rmse_deg": errors["train"],
                "heldout_rmse_deg": errors["heldout"],
                "noise_deg": errors["noise"],
            }
            for name, entry in verdict["parameters"][model].items():
                row |= {name: entry["value"], f"{name}_se": entry["se"]}
            rows.append(row)
    return pd.DataFrame(rows)
