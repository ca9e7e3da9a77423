"""What the comparisons say, in sentences, from their tables."""

import numpy as np
import pandas as pd

from myowave.diagnosis.comparison.names import EMG_ONLY, HORIZON_BASELINES, NOISE, POSTURE, POSTURE_LOAD

AS_GOOD = 0.02  # difference of R2 that is none
WORTH_TELLING = 0.99  # below this R2 noise is worth a sentence
TOLD_S = 0.5  # the horizon that the sentence names
RECORD_INSTEAD = (
    "Record trials in which the same posture and speed need different torques: holds at several angles against a hand "
    "that pushes and yields, lifts with different known loads, starts and stops at different speeds."
)

SAME_LOAD = "The settings give all training trials the same load; where it was another, correct it under conditions. "


def tell_torque(torque: pd.DataFrame, found: str) -> str:
    """How much of the torque posture, EMG and the models explain, and what to do where it is little.

    Args:
        torque: columns model, trial, held_out, rmse_Nm, r2.
        found: the model that the diagnosis found; the first of the table is the one without effects.
    """
    where, r2 = explained(torque)
    first = torque["model"].iloc[0]
    if r2[[POSTURE, first]].isna().any():
        return "The trials are too short, or too still, to compare torques."
    text = (
        f"{where}, the muscles of {first}, driven by EMG, explain R2 {r2_text(r2[first])} of the torque that the "
        f"motion needs{f' ({found}: {r2_text(r2[found])})' if found != first else ''}, posture and speed alone "
        f"{r2_text(r2[POSTURE])}"
    )
    text += f" and, told the load too, {r2_text(r2[POSTURE_LOAD])}" if POSTURE_LOAD in r2 else ""
    text += f"; EMG without physics {r2_text(r2[EMG_ONLY])}."
    if r2.get(NOISE, 1.0) < WORTH_TELLING:
        text += f" The noise of the angle leaves about {r2_text(r2[NOISE])} for a model that is right."
    if r2[[POSTURE, EMG_ONLY, first, found]].min() < 0:
        text += " Below 0 is worse than a constant torque."
    if not r2[found] > r2[POSTURE] + AS_GOOD:
        less = "less than" if r2[found] < r2[POSTURE] - AS_GOOD else "no more than"
        text += (
            f" So EMG and muscles explain {less} posture and speed do, and no verdict on the muscles can stand on "
            f"these trials. {'' if POSTURE_LOAD in r2 else SAME_LOAD}{RECORD_INSTEAD}"
        )
    elif r2[found] < r2[EMG_ONLY] - AS_GOOD:
        text += " A straight line through EMG explains more than the muscles: the physics is wrong, or its EMG is."
    elif r2[found] < r2.get(POSTURE_LOAD, -np.inf) - AS_GOOD:
        text += (
            " So EMG tells what posture does not, above all the load; but who knows the load needs no EMG here, as "
            f"every movement is much like every other. {RECORD_INSTEAD}"
        )
    return text


def tell_horizons(horizons: pd.DataFrame, found: str) -> str:
    """How far the models miss after half a second and over whole trials.

    Args:
        horizons: columns predictor, horizon_s, held_out, rmse_deg.
        found: as in `tell_torque`.
    """
    first = horizons["predictor"].iloc[0]
    where, rmse = missed(horizons)
    horizon = named_horizon(rmse)
    if horizon is None:
        return "The trials are too short to predict over short horizons."
    rival = best_rival(rmse, horizon)
    models = list(dict.fromkeys([first, found]))
    parts = [f"{m} misses by {rmse.loc[m, horizon]:.2g} deg" for m in models]
    parts.append(f"the best predictor without a model of the arm ({rival}) by {rmse.loc[rival, horizon]:.2g}")
    text = f"{where}, {horizon:g} s after a measured state {', '.join(parts)}."
    if np.inf in rmse.columns:
        whole = " and ".join(f"{m} by {rmse.loc[m, np.inf]:.2g} deg" for m in models)
        text += f" Running free over whole trials, {whole}."
    return text


def named_horizon(rmse: pd.DataFrame) -> float | None:
    """The horizon [s] nearest to half a second, of a table as `missed` gives it; None if there is none."""
    return min((h for h in rmse.columns if np.isfinite(h)), key=lambda h: abs(h - TOLD_S), default=None)


def best_rival(rmse: pd.DataFrame, horizon: float) -> str:
    """The predictor without a model of the arm that misses by least."""
    return rmse.loc[list(HORIZON_BASELINES), horizon].idxmin()


def explained(torque: pd.DataFrame) -> tuple[str, pd.Series]:
    """Mean R2 of each predictor over the held-out trials, over the training trials where there are none."""
    where, rows = _part(torque)
    return where, rows.groupby("model", sort=False)["r2"].mean()


def missed(horizons: pd.DataFrame) -> tuple[str, pd.DataFrame]:
    """RMSE [deg] by predictor and horizon, on held-out trials, on training trials where there are none."""
    where, rows = _part(horizons)
    return where, rows.pivot(index="predictor", columns="horizon_s", values="rmse_deg")


def _part(table: pd.DataFrame) -> tuple[str, pd.DataFrame]:
    if table["held_out"].any():
        return "On held-out trials", table[table["held_out"]]
    return "On training trials", table


def r2_text(value: float) -> str:
    return f"{value:.2f}" if value < 0.995 else f"{value:.4f}"
