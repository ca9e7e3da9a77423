"""The ladder: all models of a dataset side by side, the fitted physics and the networks trained with it."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from myowave.scores import TITLES, median_over_seeds

ERROR = "heldout_rmse_deg"
COLUMNS = [
    *("source", "model", "effects", "named", "train_rmse_deg", ERROR, "noise_deg", "heldout_r2", "missing_torque_Nm"),
    *("seeds", "failed_seeds"),
]
NUMBERS = ["low", "high", "value", "se", "scatter", "true", "error_pct"]
PARAMETER_COLUMNS = ["source", "model", "parameter", "unit", *NUMBERS, "assumed", "if_right", "meaning", "at_bound"]
PHYSICS, NETWORK, PLAIN = "physics", "network", "without physics"  # what the sources of rows begin with
LAST = 99  # effects of a predictor that has no model
FAILED_R2 = 0.0  # a network that predicts the held-out trials no better than their mean angle has failed


def join_ladder(
    rungs: pd.DataFrame, evaluations: Sequence[pd.DataFrame], plain: Sequence[pd.DataFrame] = ()
) -> pd.DataFrame:
    """One row per fitted model and per trained network, models with few effects first.

    Args:
        rungs: as `tables.ladder_table` gives them.
        evaluations: rows of evaluation.csv, one table for each trained network of the dataset; medians over its
            seeds, where one whose prediction is not finite counts as the worst.
        plain: the same of predictors without physics, which come last.

    Returns:
        Columns `COLUMNS`: `seeds` is the number of seeds of a network, `failed_seeds` says which of them failed.
    """
    rows = rungs.assign(source=PHYSICS, failed_seeds="").to_dict("records")
    for source, network, table in (
        *((source_of(table), True, table) for table in evaluations),
        *((f"{PLAIN}, {table['recipe'].iloc[0]}", False, table) for table in plain),
    ):
        scores, model = median_over_seeds(table), table["model"].iloc[0]
        rows.append(
            {
                "source": source,
                "model": model,
                "effects": model.count("+") if network else LAST,
                "named": False,
                ERROR: scores["test_rmse_deg"],
                "noise_deg": rungs["noise_deg"].iloc[0],
                "heldout_r2": scores["test_r2"],
                "seeds": len(table),
                "failed_seeds": _failures(table) if network else "",
            }
        )
    return pd.DataFrame(rows, columns=COLUMNS).sort_values("effects", kind="stable", ignore_index=True)


def _failures(table: pd.DataFrame) -> str:
    """Which seeds of a network failed, in words."""
    failed = table["seed"][~(table["test_r2"] > FAILED_R2)].astype(str)
    if len(failed) == len(table) > 1:
        return f"all {len(table)} seeds failed"
    return f"{len(failed)} of {len(table)} seeds failed ({', '.join(failed)})" if len(failed) else ""


def join_parameters(verdict: Mapping[str, Any], evaluations: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Every estimated parameter of every model: unit, bounds, value, standard error, true value and error where known;
    whether it is free only because nobody measured it, and whether its interval holds only `if_right` were the model.

    Args:
        verdict: verdict.json, with what scoring knows.
        evaluations: as in `join_ladder`; values and standard errors are medians over the seeds, `scatter` is that of
            the values (1 SD).
    """
    rows = [
        {"source": PHYSICS, "model": model, "parameter": name, **entry}
        for model, values in verdict["parameters"].items()
        for name, entry in values.items()
    ]
    known = {row["parameter"]: {name: row[name] for name in ("unit", "low", "high", "true", "meaning")} for row in rows}
    for table in evaluations:
        source, model = source_of(table), table["model"].iloc[0]
        for name in [c.removesuffix("_error_pct") for c in table.columns if c.endswith("_error_pct")]:
            own = {
                "value": table[name].median(),
                # All seeds see the same trials: more of them make no estimate surer.
                "se": table[f"{name}_se"].median() if f"{name}_se" in table else np.nan,
                "scatter": table[name].std(ddof=0),
                "error_pct": table[f"{name}_error_pct"].median(),
                "assumed": False,
                "at_bound": False,
            }
            rows.append({"source": source, "model": model, "parameter": name, **known.get(name, {}), **own})
    joined = pd.DataFrame(rows, columns=PARAMETER_COLUMNS).astype(dict.fromkeys(NUMBERS, float))
    joined["if_right"] = joined["model"].isin(verdict["models_that_leave_more"])
    return joined.sort_values("model", key=lambda m: m.str.count(r"\+"), kind="stable", ignore_index=True)


def baseline_of(source: str) -> str:
    """What pages call the predictor without physics that a row comes from."""
    name = source.removeprefix(f"{PLAIN}, ")
    return TITLES.get(name, name)


def of_networks(ladder: pd.DataFrame) -> pd.DataFrame:
    """The rows of networks."""
    return ladder[ladder["source"].str.startswith(NETWORK)]


def shown_network(ladder: pd.DataFrame, found: str) -> pd.Series | None:
    """The network that pages show: of the model that was found, else of the first, with the fewest scales; its scores
    play no part in that. None where there is none."""
    networks = of_networks(ladder)
    best = networks[networks["model"] == found]
    return None if networks.empty else (networks if best.empty else best).iloc[0]


def folder_of(network: pd.Series) -> str:
    """The end of the path of a network's results, `base/rollout/1-scale`."""
    _, recipe, scales = network["source"].split(", ")
    return f"{network['model']}/{recipe}/{scales}"


def source_of(evaluation: pd.DataFrame) -> str:
    """What a row of the ladder comes from: `network, rollout, 1-scale`."""
    first = evaluation.iloc[0]
    return f"{NETWORK}, {first['recipe']}, {first['scales']}-scale"
