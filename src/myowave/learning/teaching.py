"""What physics teaches a network: the same recipe with trials simulated with the identified parameters, with the
residual of the equation of motion along its own rollouts, with both, and with neither."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from myowave.learning.scales import CLEAR
from myowave.settings import Recipe

SIMULATED = 64  # trials, where the recipe has none of its own
WAYS = {  # what physics teaches by: whether simulated trials, whether the residual
    "neither": (False, False),
    "simulated trials": (True, False),
    "residual": (False, True),
    "both": (True, True),
}
BESIDE = "simulated trials"  # what the others are compared with


def taught_by(recipe: Recipe, way: str, beta: float) -> Recipe:
    """The recipe in which physics teaches in one of the `WAYS`, the residual with the weight `beta`."""
    simulated, residual = WAYS[way]
    changes = {
        "simulated_trials": (recipe.simulated_trials or SIMULATED) if simulated else 0,
        "beta": beta if residual else 0.0,
        "band": "none",  # which is not compared
        "residual_torque": "averaged" if residual else recipe.residual_torque,
    }
    return recipe.changed(changes)


def tabulate_ways(scores: pd.DataFrame) -> pd.DataFrame:
    """One row per dataset, model, number of scales and way.

    Args:
        scores: rows of evaluations with the further column way.

    Returns:
        r2, lowest, highest and rmse_deg (median over seeds, and ends); gain_r2 over simulated trials alone, mean over
        seeds, its standard_error, and a finding.
    """
    rows = []
    for place, group in scores.groupby(["dataset", "model", "recipe", "scales"], sort=False):
        r2 = group.pivot(index="seed", columns="way", values="test_r2")
        errors = group.groupby("way")["test_rmse_deg"].median()
        for way in WAYS:
            gain = (r2[way] - r2[BESIDE]).to_numpy()
            mean, error = gain.mean(), gain.std(ddof=1) / np.sqrt(len(gain)) if len(gain) > 1 else np.nan
            clear = abs(mean) > CLEAR * error
            rows.append(
                (
                    *place,
                    way,
                    len(gain),
                    r2[way].median(),
                    r2[way].min(),
                    r2[way].max(),
                    errors[way],
                    mean,
                    error,
                    "" if way == BESIDE else ("better" if mean > 0 else "worse") if clear else "no clear difference",
                )
            )
    columns = ["dataset", "model", "recipe", "scales", "way", "seeds", "r2", "lowest", "highest", "rmse_deg"]
    return pd.DataFrame(rows, columns=[*columns, "gain_r2", "standard_error", "finding"])


def write_page(table: pd.DataFrame, study: Mapping[str, Any]) -> str:
    """The table as Markdown.

    Args:
        study: settings of the comparison, `learning.teaching`.
    """
    lines = [
        "# What physics teaches the network",
        "",
        f"Recipes as they are, but for what physics teaches by: trials simulated with the identified parameters, the "
        f"residual of the equation of motion along the network's own rollouts (beta {study['beta']:g}), both, or "
        f"neither. Test R² and error, free running: medians of {table['seeds'].min()} seeds, lowest and highest. "
        f"Gain: R² less that with {BESIDE} alone, seed by seed, and its standard error; a difference counts from "
        f"{CLEAR:g} on. Written by `snakemake teaching --cores 2`.",
        "",
        "| dataset | physics | scales | taught by | R² | lowest to highest | error [deg] | gain | finding |",
        "|---" * 9 + "|",
    ]
    for row in table.to_dict("records"):
        gain = "" if row["way"] == BESIDE else f"{row['gain_r2']:+.4f} ± {row['standard_error']:.4f}"
        lines.append(
            f"| {row['dataset']} | {row['model']} | {row['scales']} | {row['way']} | {row['r2']:.4f} | "
            f"{row['lowest']:.4f} to {row['highest']:.4f} | {row['rmse_deg']:.2f} | {gain} | {row['finding']} |"
        )
    return "\n".join(lines) + "\n"
