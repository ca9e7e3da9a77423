"""Pictures of a diagnosis, one module per step: glance, comparisons, where, which, watch. Drawn only from its tables.

Where there are several models, the first (without any effect added) and the one that was found are shown.
"""

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from myowave.diagnosis.report.figures.comparisons import draw_horizons, draw_torque
from myowave.diagnosis.report.figures.glance import draw_glance
from myowave.diagnosis.report.figures.watch import draw_ladder
from myowave.diagnosis.report.figures.where import draw_missing_torque
from myowave.diagnosis.report.figures.which import draw_ranking
from myowave.diagnosis.report.ladder import PLAIN, of_networks
from myowave.diagnosis.report.tell import base_of, noise, noise_with_emg


def draw_diagnosis(
    tables: Mapping[str, pd.DataFrame], predictions: pd.DataFrame, verdict: Mapping[str, Any]
) -> dict[str, Figure]:
    """All pictures of a dataset, by name.

    Args:
        tables: those of `tables.TABLES`, with `ladder` as `ladder` joins it, and those of `comparison.compare`.
        predictions: measured and predicted angle, from `motion.beside`.
    """
    (model, errors), found, ladder = base_of(verdict), verdict["model"], tables["ladder"]
    angle = {f"noise of the angle, {noise(verdict)}": errors["noise"]}
    of_emg = {"noise of the angle and of the EMG": noise_with_emg(verdict)} if verdict["emg_noise"] else {}
    ends = list(dict.fromkeys((model, found)))
    others = set(verdict["rmse_deg"]) - set(ends)
    missing = tables["missing_torque"]
    return {
        "glance": draw_glance(predictions[~predictions["model"].isin(others)], ends),
        "torque": draw_torque(tables["torque"]),
        "horizons": draw_horizons(tables["horizons"], angle, of_networks(ladder), found),
        "missing_torque": draw_missing_torque(missing[missing["model"].isin(ends)]),
        "ranking": draw_ranking(tables["ranking"], verdict["titles"]),
        "ladder": draw_ladder(ladder[~ladder["source"].str.startswith(PLAIN)], angle | of_emg, verdict["horizon_s"]),
    }
