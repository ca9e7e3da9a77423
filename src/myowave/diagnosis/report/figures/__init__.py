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
from myowave.diagnosis.report.tell import base_of, tell
from myowave.plotting import title


def draw_diagnosis(
    tables: Mapping[str, pd.DataFrame], predictions: pd.DataFrame, verdict: Mapping[str, Any]
) -> dict[str, Figure]:
    """All pictures of a dataset, by name.

    Args:
        tables: those of `tables.TABLES`, with `ladder` and `parameters` as `ladder` joins them, and those of
            `comparison.compare`.
        predictions: measured and simulated angle, from `tables.predictions_table`.
        verdict: verdict.json.
    """
    told, found = tell(verdict), verdict["model"]
    model, errors = base_of(verdict)
    levels = {f"noise of the angle, {told.noise}": errors["noise"]}
    if told.noise_with_emg is not None:
        levels["noise of the angle and of the EMG"] = told.noise_with_emg
    angle = dict(list(levels.items())[:1])
    networks = tables["ladder"][tables["ladder"]["source"] != PHYSICS]

    def of_ends(table: pd.DataFrame) -> pd.DataFrame:
        return table[table["model"].isin((model, found))]

    figures = {
        "overlay": draw_overlay(of_ends(predictions)),
        "errors": draw_errors(tables["errors"], found, levels),
        "torque": draw_torque(tables["torque"]),
        "horizons": draw_horizons(tables["horizons"], angle, networks, found),
        "correlations": draw_correlations(of_ends(tables["correlations"])),
        "misfit": draw_misfit(of_ends(tables["misfit"]), angle),
        "missing_torque": draw_missing_torque(of_ends(tables["missing_torque"])),
        "ranking": draw_ranking(with_texts(tables["ranking"]), verdict["titles"]),
        "ladder": draw_ladder(tables["ladder"], levels, verdict["horizon_s"]),
        "parameters": draw_parameters(tables["parameters"]),
    }
    for name, figure in figures.items():
        title(figure, told.titles[name])
    return figures
