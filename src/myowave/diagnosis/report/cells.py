"""Tables of a diagnosis as text for its page: columns as they are headed, and a row of cells for each row.

They are made of verdict.json, `ladder.join_ladder`, `ladder.join_parameters` and the table `ranking`.
"""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from myowave.diagnosis.report.ladder import NETWORK, PHYSICS, PLAIN, baseline_of
from myowave.diagnosis.report.numbers import NOTHING, degrees, estimate, number, r2_text
from myowave.diagnosis.report.tell import base_of, best_rival
from myowave.diagnosis.report.templates import called, described, of_muscles, with_unit

NAMED = 3  # of the parameters that absorb an effect


def read_ranking(path: str | Path) -> pd.DataFrame:
    """The table `ranking` of its file; texts are empty where nothing stands."""
    texts = ["absorbed_by", "confused_with", "reason", "estimate"]
    table = pd.read_csv(path, dtype=dict.fromkeys(texts, object))
    return table.fillna(dict.fromkeys(texts, ""))


def accuracy_cells(verdict: Mapping[str, Any], ladder: pd.DataFrame) -> pd.DataFrame:
    """Every error of the page, and what it is of: which predictor, from which start, over how long."""
    (base, first), horizon, ahead = base_of(verdict), verdict["horizon_s"], verdict["horizons"]
    model = partial(described, titles=verdict["titles"])
    state, whole = f"{'fitted' if horizon is None else 'measured'} angle and speed", "whole trials"
    pieces = whole if horizon is None else f"all of {horizon:g} s"
    rows: list[tuple[str, str, str, str, str, str]] = []
    if horizon is not None:
        rows.append((model(base), "the best start of each piece", pieces, degrees(first["fitted"]), "", ""))
    for row in ladder[ladder["source"] == PHYSICS].to_dict("records"):
        errors = degrees(row["train_rmse_deg"]), degrees(row["heldout_rmse_deg"])
        rows.append((model(row["model"]), state, pieces, *errors, r2_text(row["heldout_r2"])))
    if horizon is not None and ahead["horizon_s"] is not None:
        rmse, at = ahead["rmse_deg"], f"the end of {ahead['horizon_s']:g} s"
        for name in dict.fromkeys((base, verdict["model"], best_rival(verdict))):
            errors = ("", degrees(rmse[name])) if ahead["held_out"] else (degrees(rmse[name]), "")
            rows.append((model(name), state, at, *errors, ""))
    for row in ladder[ladder["source"] != PHYSICS].to_dict("records"):
        failed = str(row["failed_seeds"] or "").replace("nan", "")
        network = row["source"].startswith(NETWORK)
        of = model(f"{row['source']}, {row['model']}") if network else f"{PLAIN}: {baseline_of(row['source'])}"
        what = of + f"; {failed}" * bool(failed)
        rows.append((what, "first angles", whole, "", degrees(row["heldout_rmse_deg"]), r2_text(row["heldout_r2"])))
    heads = ["what", "starts from", "error over", "training error", "held-out error", "held-out R²"]
    return pd.DataFrame(rows, columns=heads)


def ranking_cells(rows: pd.DataFrame, verdict: Mapping[str, Any]) -> pd.DataFrame:
    """The catalogue weighed at one model; without columns in which nothing stands."""
    meanings = {name: p["meaning"] for of in verdict["parameters"].values() for name, p in of.items()}

    def listed(r: Any) -> str:
        if r.status != "absorbed":
            return ", ".join(called(name, verdict["titles"]) for name in r.confused_with.split())
        by = [of_muscles(meanings.get(name, name)) for name in r.absorbed_by.split()] or ["parameters together"]
        more = f" and {len(by) - NAMED} more" * (len(by) > NAMED)
        return f"absorbed by {', '.join(by[:NAMED])}{more}"

    cells = pd.DataFrame(
        {
            "effect": rows["effect"],
            "status": rows["status"],
            "log odds": rows["log_odds"].map(number),
            # Over other pieces than the page's errors are, where the model follows no whole trial.
            "error of the fit [deg]": rows["rmse_deg"].map(number) if verdict["follows"] else "",
            "estimate": rows["estimate"],
            "smallest detectable": [
                number(r.smallest_detectable) + with_unit(r.unit)
                if np.isfinite(r.smallest_detectable) and r.status != "absorbed"
                else ""
                for r in rows.itertuples()
            ],
            "like": [listed(r) for r in rows.itertuples()],
            "why not": rows["reason"],
        }
    )
    return cells.loc[:, (cells != "").any()]


def parameter_cells(parameters: pd.DataFrame, titles: Mapping[str, str] | None = None) -> pd.DataFrame:
    """Estimated parameters by what they mean; of several models and networks with `titles`, by which these are named;
    true values where they are known."""
    scatter = parameters["scatter"].mask(parameters["scatter"] <= NOTHING * parameters["value"].abs(), 0.0)
    of = {}
    if titles is not None:
        source = parameters["source"].replace(PHYSICS, described("base", titles))
        of = {"model": parameters["model"], "from": source}
    cells = pd.DataFrame(
        {
            "parameter": [f"{of_muscles(r.meaning)} ({r.parameter})" for r in parameters.itertuples()],
            **of,
            "value ± SE": [estimate(r.value, r.se, (r.low, r.high)) for r in parameters.itertuples()],
            "unit": parameters["unit"].fillna("").replace("-", ""),
            "scatter of seeds": scatter.map(number),
            "true value": parameters["true"].map(number),
            "error [%]": parameters["error_pct"].map(number),
            "note": [
                "; ".join(["at its bound"] * bool(r.at_bound) + ["if the model were right"] * bool(r.if_right))
                for r in parameters.itertuples()
            ],
        }
    )
    return cells.loc[:, (cells != "").any()]
