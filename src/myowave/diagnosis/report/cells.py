"""Tables of a diagnosis as text for its page: columns as they are headed, and a row of cells for each row."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from myowave.diagnosis.report.ladder import PHYSICS
from myowave.diagnosis.report.numbers import LEAST_DEG, NOTHING, estimate, number

RANKING_TEXTS = ("absorbed_by", "confused_with", "reason", "estimate")


def ranking_cells(rows: pd.DataFrame) -> pd.DataFrame:
    """The catalogue weighed at one model; without columns in which nothing stands."""
    absorbed = "absorbed by " + rows["absorbed_by"].str.replace(" ", ", ").replace("", "parameters together")
    cells = pd.DataFrame(
        {
            "effect": rows["effect"],
            "status": rows["status"],
            "delta BIC": rows["delta_bic"].map(number),
            "RMSE [deg]": rows["rmse_deg"].map(number),
            "folds won": rows["folds_won"].astype(str) + " of " + rows["folds"].astype(str),
            "estimate": rows["estimate"].str.replace("+-", "±"),
            "smallest detectable": rows["smallest_detectable"].map(number),
            "like": rows["confused_with"].str.replace(" ", ", ").where(rows["status"] != "absorbed", absorbed),
            "why not": rows["reason"],
        }
    )
    return cells.loc[:, (cells != "").any()]


def ladder_cells(ladder: pd.DataFrame) -> pd.DataFrame:
    """Every model, the physics and the networks."""
    failed = ladder["failed_seeds"].fillna("").astype(str)
    return pd.DataFrame(
        {
            "model": ladder["model"],
            "what": [
                _what(source) + f"; {seeds} of {count:.0f} failed" * bool(seeds)
                for source, seeds, count in zip(ladder["source"], failed, ladder["seeds"], strict=True)
            ],
            "training RMSE [deg]": [number(error, LEAST_DEG) for error in ladder["train_rmse_deg"]],
            "held-out RMSE [deg]": [number(error, LEAST_DEG) for error in ladder["heldout_rmse_deg"]],
            "held-out R2": ["" if pd.isna(r2) else f"{r2:.5f}" for r2 in ladder["heldout_r2"]],
            "missing torque [N m]": ladder["missing_torque_Nm"].map(number),
        }
    )


def parameter_cells(parameters: pd.DataFrame) -> pd.DataFrame:
    """Every estimated parameter of every model; scatter over the seeds of networks and true error where known."""
    scatter = parameters["scatter"].mask(parameters["scatter"] <= NOTHING * parameters["value"].abs(), 0.0)
    cells = pd.DataFrame(
        {
            "parameter": parameters["parameter"],
            "model": parameters["model"],
            "what": [
                _what(source) + ", were it right" * bool(if_right)
                for source, if_right in zip(parameters["source"], parameters["if_right"], strict=True)
            ],
            "value ± SE": [estimate(r.value, r.se, (r.low, r.high)) for r in parameters.itertuples()],
            "unit": parameters["unit"].fillna(""),
            "scatter of seeds": scatter.map(number),
            "true error [%]": parameters["error_pct"].map(number),
        }
    )
    shown = cells.columns.difference(["scatter of seeds", "true error [%]"], sort=False)
    known = [c for c in ("scatter of seeds", "true error [%]") if (cells[c] != "").any()]
    return cells[[*shown, *known]]


def proposal_cells(proposals: pd.DataFrame) -> pd.DataFrame:
    """Trials to record next."""
    return pd.DataFrame(
        {
            "trial": proposals["trial"],
            "separation [chi-square]": proposals["separation"].map("{:.3g}".format),
            "now": proposals["now"].map("{:.3g}".format),
            "enough": np.where(proposals["separates"].astype(bool), "yes", "no"),
        }
    )


def with_texts(table: pd.DataFrame, columns: Iterable[str] = RANKING_TEXTS) -> pd.DataFrame:
    """A table that was read from its file, where a column without any text holds numbers that are not there."""
    return table.assign(**{name: table[name].astype(object).fillna("") for name in columns if name in table})


def _what(source: str) -> str:
    return "physical model" if source == PHYSICS else source
