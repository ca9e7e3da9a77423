"""Compare measured and modelled motion in three ways, from the one that never diverges.

A verdict on an arm must not stand on free running only: small errors grow there until the motion has little to do with
what is wrong. So the same fitted models are asked first for the torque along the measured motion (`torque`), then for
short horizons from measured states, then for whole trials (`horizons`). Nothing is fitted again.
"""

from collections.abc import Callable

import pandas as pd

from myowave.data.trials import Trials
from myowave.diagnosis.comparison.horizons import compare_horizons
from myowave.diagnosis.comparison.torque import compare_torque
from myowave.identification.along import Along
from myowave.identification.record import make_record
from myowave.physics.model import Model


def compare_models(
    trials: Trials, build: Callable[[str], Model], parameters: pd.DataFrame, errors: pd.DataFrame
) -> dict[str, pd.DataFrame]:
    """The tables of the comparisons, {"torque": ..., "horizons": ...}; see `compare_torque` and `compare_horizons`.

    Args:
        build: from a name such as `base+joint_damping` to the model.
        parameters, errors: tables of a diagnosis. The latter says which models there are, the one without effects
            first.
    """
    models = {name: build(name) for name in errors["model"].unique()}
    record = make_record(trials, next(iter(models.values())), float(errors["noise_deg"].iloc[0]))
    fitted = {name: dict(zip(p["parameter"], p["fitted"], strict=True)) for name, p in parameters.groupby("model")}
    along = [Along(model, record, fitted.get(name, {})) for name, model in models.items()]
    return {"torque": compare_torque(along), "horizons": compare_horizons(along, errors)}
