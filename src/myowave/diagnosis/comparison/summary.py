"""What is named of the comparisons with trials: numbers for verdict.json. Nothing heavy is imported here."""

from typing import Any

import numpy as np
import pandas as pd

from myowave.data.json_files import number_or_none

NAMED_S = 0.5  # of the horizons, the nearest to this is the one that is named


def summarize(torque: pd.DataFrame, horizons: pd.DataFrame) -> dict[str, Any]:
    """The facts that verdict.json has of the comparisons, on held-out trials where there are any.

    Args:
        torque: columns model, held_out, r2; horizons: columns predictor, horizon_s, held_out, rmse_deg.

    Returns:
        torque: mean R2 over trials of each predictor, None where there is no window, the least number where its torque
        overflows; horizons: the horizon nearest to half a second, None where trials are shorter, each predictor's RMSE
        there, and over whole trials, None where the motion overflows.
    """
    r2 = _shown(torque).groupby("model", sort=False)["r2"].mean()
    rmse = _shown(horizons).pivot(index="predictor", columns="horizon_s", values="rmse_deg")
    horizon = min((h for h in rmse.columns if np.isfinite(h)), key=lambda h: abs(h - NAMED_S), default=None)
    near, whole = (rmse.get(h, pd.Series(dtype=float)).dropna() for h in (horizon, np.inf))
    return {
        "torque": {
            "held_out": bool(torque["held_out"].any()),
            "r2": {name: None if np.isnan(value) else float(np.nan_to_num(value)) for name, value in r2.items()},
        },
        "horizons": {
            "held_out": bool(horizons["held_out"].any()),
            "horizon_s": horizon,
            "rmse_deg": {name: number_or_none(value) for name, value in near.items()},
            "whole_deg": {name: number_or_none(value) for name, value in whole.items()},
        },
    }


def _shown(table: pd.DataFrame) -> pd.DataFrame:
    return table[table["held_out"]] if table["held_out"].any() else table
