"""Pictures of a diagnosis, one module per step: glance, comparisons, where, which, watch. Drawn only from its tables.

Where there are several models, the first (without any effect added) and the one that was found are shown.
"""

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from myowave.diagnosis.report.advice import base_of
from myowave.diagnosis.report.cells import with_texts
from myowave.diagnosis.report.figures.comparisons import draw_horizons, draw_torque
from myowave.diagnosis.report.figures.glance import draw_glance
from myowave.diagnosis.report.figures.watch import draw_ladder
from myowave.diagnosis.report.figures.where import draw_missing_torque
from myowave.diagnosis.report.figures.which import draw_ranking
from myowave.diagnosis.report.ladder import PLAIN, of_networks
from myowave.diagnosis.report.tell import tell


def draw_diagnosis(
    tables: Mapping[str, pd.DataFrame], predictions: pd.DataFrame, verdict: Mapping[str, Any]
) -> dict[str, Figure]:
    """All pictures of a dataset, by name.

    Args:
        tables: those of `tables.TABLES`, with `ladder` as `ladder` joins it, and those of `comparison.compare`.
        predictions: measured and predicted angle, from `motion.beside`.
        verdict: verdict.json.
    """
    told, found = tell(verdict), verdict["model"]
    model, errors = base_of(verdict)
    levels = {f"noise of the angle, {told.noise}": errors["noise"]}
    if told.noise_with_emg is not None:
        levels["noise of the angle and of the EMG"] = told.noise_with_emg
    angle = dict(list(levels.items())[:1])
    networks = of_networks(tables["ladder"])
    ends = list(dict.fromkeys((model, found)))

    def of_ends(table: pd.DataFrame) -> pd.DataFrame:
        return table[table["model"].isin(ends)]

    others = predictions["model"].isin(set(verdict["rmse_deg"]) - set(ends))
    return {
        "glance": draw_glance(predictions[~others], ends),
        "torque": draw_torque(tables["torque"]),
        "horizons": draw_horizons(tables["horizons"], angle, networks, found),
        "missing_torque": draw_missing_torque(of_ends(tables["missing_torque"])),
        "ranking": draw_ranking(with_texts(tables["ranking"]), verdict["titles"]),
        "ladder": draw_ladder(
            tables["ladder"][~tables["ladder"]["source"].str.startswith(PLAIN)], levels, verdict["horizon_s"]
        ),
    }
