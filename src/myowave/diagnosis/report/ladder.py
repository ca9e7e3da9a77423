"""The ladder: all models of a dataset side by side, the fitted physics and the networks trained with it."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from myowave.scores import median_over_seeds

COLUMNS = [
    "source",
    "model",
    "effects",
    "named",
    "train_rmse_deg",
    "heldout_rmse_deg",
    "noise_deg",
    "heldout_r2",
    "missing_torque_Nm",
    "seeds",
    "failed_seeds",
]
PARAMETER_COLUMNS = [
    *("source", "model", "parameter", "value", "se", "scatter", "true", "error_pct", "assumed", "if_right"),
]
PHYSICS = "physics"
FAILED_R2 = 0.0  # a network that predicts the held-out trials no better than their mean angle has failed


def join_ladder(rungs: pd.DataFrame, evaluations: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """One row per fitted model and per trained network, models with few effects first.

    Args:
        rungs: as `tables.ladder_table` gives them.
        evaluations: rows of evaluation.csv, one table for each trained network of the dataset; medians over its
            seeds, where one whose prediction is not finite counts as the worst.

    Returns:
        Columns `COLUMNS`: `seeds` is the number of seeds of a network, `failed_seeds` says in words which failed.
    """
    physics = rungs.assign(source=PHYSICS, failed_seeds="")
    networks = [
        {
            "source": source_of(table),
            "model": table["model"].iloc[0],
            "effects": table["model"].iloc[0].count("+"),
            "named": False,
            "heldout_rmse_deg": float(np.degrees(np.sqrt(median_over_seeds(table)["test_mse"]))),
            "noise_deg": rungs["noise_deg"].iloc[0],
            "heldout_r2": median_over_seeds(table)["test_r2"],
            "seeds": len(table),
            "failed_seeds": _seeds(table["seed"][~(table["test_r2"] > FAILED_R2)]),
        }
        for table in evaluations
    ]
    joined = pd.concat([physics, pd.DataFrame(networks, columns=COLUMNS)]) if networks else physics
    return joined.reindex(columns=COLUMNS).sort_values("effects", kind="stable", ignore_index=True)


def tell_failed_seeds(ladder: pd.DataFrame) -> list[str]:
    """A sentence for each network of which seeds failed; ladder as `join_ladder` gives it, also read from its file."""
    return [
        f"{row.source} with {row.model}: {row.failed_seeds} of {row.seeds:.0f} failed: no better on held-out trials "
        "than a constant angle, or its motion runs away. The numbers are medians over all seeds."
        for row in ladder[ladder["failed_seeds"].fillna("") != ""].itertuples()
    ]


def _seeds(seeds: Sequence[int]) -> str:
    """Seeds in words; empty where there are none."""
    *others, last = map(str, seeds) if len(seeds) else ("",)
    return f"seeds {', '.join(others)} and {last}" if others else f"seed {last}" if last else ""


def steps(ranking: pd.DataFrame) -> dict[str, str]:
    """Each model of the ladder but the last, with the effect that the next one adds.

    Args:
        ranking: the table `ranking` of `tables`.
    """
    models = dict.fromkeys(ranking["model"])
    return {model: richer.removeprefix(model).strip("+") for model, richer in pairwise(models)}


def join_parameters(
    verdict: Mapping[str, Any], evaluations: Sequence[pd.DataFrame], fitted: pd.DataFrame
) -> pd.DataFrame:
    """Every estimated parameter of every model: unit, bounds, value, standard error, true value and error where known;
    whether it is free only because nobody measured it, and whether its interval holds only `if_right` were the model.

    Args:
        verdict: verdict.json, its errors filled in where they are known.
        evaluations: as in `join_ladder`; values and standard errors are medians over the seeds, `scatter` is that of
            the values (1 SD).
        fitted: columns parameter, unit, low, high of every parameter.
    """
    rows = [
        (
            *(PHYSICS, model, name, entry["value"], entry["se"], np.nan, entry["true"], entry["error_pct"]),
            *(entry["assumed"], model in verdict["models_that_leave_more"]),
        )
        for model, values in verdict["parameters"].items()
        for name, entry in values.items()
    ]
    known = {name: entry["true"] for values in verdict["parameters"].values() for name, entry in values.items()}
    for table in evaluations:
        for name in [c.removesuffix("_error_pct") for c in table.columns if c.endswith("_error_pct")]:
            error = table[f"{name}_error_pct"].median()
            spread = table[name].std(ddof=0)
            value, true = table[name].median(), known.get(name)
            model = table["model"].iloc[0]
            # All seeds see the same trials: more of them make no estimate surer.
            se = table[f"{name}_se"].median() if f"{name}_se" in table else np.nan
            if_right = model in verdict["models_that_leave_more"]
            rows.append((source_of(table), model, name, value, se, spread, true, error, False, if_right))
    joined = pd.DataFrame(rows, columns=PARAMETER_COLUMNS)
    for place, column in enumerate(("unit", "low", "high"), 3):
        joined.insert(
            place, column, joined["parameter"].map(fitted.drop_duplicates("parameter").set_index("parameter")[column])
        )
    joined[["true", "error_pct"]] = joined[["true", "error_pct"]].astype(float)
    order = joined["model"].str.count(r"\+")
    return joined.iloc[np.argsort(order, kind="stable")].reset_index(drop=True)


def source_of(evaluation: pd.DataFrame) -> str:
    """What a row of the ladder comes from: `network, rollout, 1-scale`."""
    first = evaluation.iloc[0]
    return f"network, {first['recipe']}, {first['scales']}-scale"
