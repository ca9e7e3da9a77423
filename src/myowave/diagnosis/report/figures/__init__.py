"""Pictures of a diagnosis, one module per step: compare, comparisons, where, which, watch. Drawn only from its tables.

Where there are several models, the first (without any effect added) and the one that was found are shown.
"""

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from myowave.diagnosis.report.cells import with_texts
from myowave.diagnosis.report.figures.compare import draw_correlations, draw_errors, draw_overlay
from myowave.diagnosis.report.figures.comparisons import draw_horizons, draw_torque
from myowave.diagnosis.report.figures.watch import draw_ladder, draw_parameters
from myowave.diagnosis.report.figures.where import draw_misfit, draw_missing_torque
from myowave.diagnosis.report.figures.which import draw_ranking
from myowave.diagnosis.report.ladder import PHYSICS
from myowave.diagnosis.report.words import noise as tell_noise
from myowave.diagnosis.report.words import noise_with_emg


def draw_diagnosis(
    tables: Mapping[str, pd.DataFrame], predictions: pd.DataFrame, summary: Mapping[str, Any]
) -> dict[str, Figure]:
    """All pictures of a dataset, by name.

    Args:
        tables: those of `tables.TABLES`, with `ladder` and `parameters` as `ladder` joins them, and those of
            `comparison.compare`.
        predictions: measured and simulated angle, from `tables.predictions_table`.
        summary: from `tables.verdict_summary`.
    """
    errors, found = tables["errors"], summary["model"]
    ranking = with_texts(tables["ranking"])
    said = tell_noise(summary)
    noise, ladder = errors["noise_deg"].iloc[0], tables["ladder"]
    with_emg = noise_with_emg(summary)
    ends = (next(iter(summary["rmse_deg"])), found)

    heldout = {model: errors["heldout"] for model, errors in summary["rmse_deg"].items()}

    def of_ends(table: pd.DataFrame) -> pd.DataFrame:
        return table[table["model"].isin(ends)]

    return {
        "overlay": draw_overlay(of_ends(predictions), of_ends(errors), said),
        "errors": draw_errors(errors, heldout, found, said, with_emg),
        "torque": draw_torque(tables["torque"], found),
        "horizons": draw_horizons(tables["horizons"], noise, said, ladder[ladder["source"] != PHYSICS], found),
        "correlations": draw_correlations(of_ends(tables["correlations"])),
        "misfit": draw_misfit(of_ends(tables["misfit"]), noise, summary["where"]),
        "missing_torque": draw_missing_torque(of_ends(tables["missing_torque"])),
        "ranking": draw_ranking(ranking, summary["titles"], summary["follows"]),
        "ladder": draw_ladder(ladder, found, said, with_emg, summary["horizon_s"]),
        "parameters": draw_parameters(tables["parameters"], found),
    }
