"""Measured and predicted motion as plain numbers for the picture that the page draws itself."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from myowave.data.store import read_table
from myowave.diagnosis.report.ladder import folder_of, shown_network
from myowave.diagnosis.report.tell import base_of
from myowave.diagnosis.report.templates import described

MOST_NUMBERS = 60_000  # angles on a page: some 400 kB; more trials than that are thinned
FARTHEST_DEG = 1e4  # a motion beyond it is drawn as a gap


def read_beside(path: str, ladder: pd.DataFrame, found: str, networks: Path) -> pd.DataFrame:
    """`beside` of files: predictions.parquet of a diagnosis, and that of the network of a ladder that is shown with the
    model that was found, in the folder of all networks of the dataset."""
    shown, network = shown_network(ladder, found), None
    if shown is not None:
        network = read_table(networks / folder_of(shown) / "predictions.parquet")[0]
    return beside(read_table(path)[0], "" if shown is None else f"{shown['source']}, {shown['model']}", network)


def beside(predictions: pd.DataFrame, name: str, network: pd.DataFrame | None) -> pd.DataFrame:
    """Predictions of the physical models and of a network, on the samples of the former; a prediction that starts again
    at a measured state has a gap there.

    Args:
        predictions: columns model, trial, role, piece, time_s, angle_rad, predicted_rad.
        name: of the network.
        network: columns trial, seed, time_s, predicted_rad, of which the mean over seeds is shown; None where there is
            none.
    """
    own = predictions.groupby(["model", "trial"], sort=False)["piece"]
    shown = [predictions.assign(predicted_rad=predictions["predicted_rad"].mask(own.diff() > 0))]
    if network is not None:
        mean = network.groupby(["trial", "time_s"])["predicted_rad"].mean()
        first = predictions[predictions["model"] == predictions["model"].iloc[0]]
        for trial, rows in first.groupby("trial", sort=False):
            angle = np.interp(rows["time_s"], mean[trial].index, mean[trial], right=np.nan)
            shown.append(rows.assign(model=name, predicted_rad=angle))
    return pd.concat(shown, ignore_index=True)


def list_motion(predictions: pd.DataFrame, verdict: Mapping[str, Any]) -> dict[str, Any]:
    """What the page draws, as JSON has it.

    Args:
        predictions: columns model, trial, role (train or test), time_s, angle_rad, predicted_rad; every model has every
            trial.
        verdict: verdict.json.

    Returns:
        models: in words, the one without effects first; found: place of the one that was found; every: of so many
        samples one is kept; noise_deg: of the angle, an error below it is not drawn large; trials: name, held_out,
        begin_s, step_s, measured and, one list for each model, predicted, in thousandths of a degree, None where a
        motion is not finite or far out.
    """
    models = list(dict.fromkeys(predictions["model"]))
    every = max(1, -(-len(predictions) * (len(models) + 1) // (len(models) * MOST_NUMBERS)))
    trials = []
    for name, rows in predictions.groupby("trial", sort=False):
        parts = {model: part.iloc[::every] for model, part in rows.groupby("model", sort=False)}
        first = parts[models[0]]
        time = first["time_s"].to_numpy()
        trials.append(
            {
                "name": str(name).removeprefix("trial"),
                "held_out": bool(first["role"].iloc[0] == "test"),
                "begin_s": round(float(time[0]), 6),
                "step_s": round(float(time[-1] - time[0]) / max(len(time) - 1, 1), 9),
                "measured": _thousandths(first["angle_rad"]),
                "predicted": [_thousandths(parts[model]["predicted_rad"]) for model in models],
            }
        )
    again = f", started anew every {verdict['horizon_s']:g} s" if verdict["horizon_s"] else ""
    labels = [described(m, verdict["titles"]) + again * (m in verdict["rmse_deg"]) for m in models]
    about = {"models": labels, "found": models.index(verdict["model"]), "every": every}
    return about | {"noise_deg": round(base_of(verdict)[1]["noise"], 6), "trials": trials}


def _thousandths(angle_rad: pd.Series) -> list[int | None]:
    angle = np.degrees(angle_rad.to_numpy(dtype=float))
    return [round(1000 * float(a)) if abs(a) < FARTHEST_DEG else None for a in angle]
