"""What the paper prints, and the same numbers as they come out here.

Source of all printed values: Taneja et al. 2023, Tables 3 to 5 (mean and standard deviation over seeds).
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from myowave.learning.tables import read_histories

PARAMETERS = ("f0_Bi", "f0_Tri", "l0_Bi", "l0_Tri")
PRINTED_ERROR_PCT = {  # Table 3: (mean, SD) of 3-scale training
    "case1": {"f0_Bi": (0.50, 0.02), "f0_Tri": (0.06, 0.02), "l0_Bi": (0.10, 0.03), "l0_Tri": (-0.06, 0.07)},
    "case2": {"f0_Bi": (0.50, 0.01), "f0_Tri": (-0.04, 0.02), "l0_Bi": (0.10, 0.02), "l0_Tri": (-0.05, 0.02)},
    "case3": {"f0_Bi": (0.37, 0.04), "f0_Tri": (-0.02, 0.03), "l0_Bi": (0.05, 0.05), "l0_Tri": (-0.03, 0.10)},
}
PRINTED_TEST = {  # Table 4: scales: (NMSE, R2), of the paper's subject
    1: (8.00e-4, 0.599),
    2: (5.74e-4, 0.713),
    3: (4.14e-4, 0.793),
    4: (2.33e-4, 0.884),
}
PRINTED_VALUES = {  # Table 5: identified (mean, SD) and literature (low, high), SI units, of the paper's subject
    "f0_Bi": ((348.23, 0.2), (158.4, 845.0)),
    "l0_Bi": ((0.108, 0.001), (0.115, 0.142)),
    "f0_Tri": ((758.36, 0.5), (554.4, 2332.916)),
    "l0_Tri": ((0.069, 0.001), (0.067, 0.087)),
}
RECORDED_WITH = {"f0_Bi": 300.0, "l0_Bi": 0.6, "f0_Tri": 300.0, "l0_Tri": 0.4}  # data/bench_elbow/README.md, SI units
CHOICES = (  # settings of a recipe that decide what comes out
    "history_steps",
    "emg_input",
    "residual",
    "beta",
    "history_noise",
    "epochs",
    "batches",
)
TWICE = 2.0  # a mean error up to so many times the printed one counts as reproduced
AT_LIMIT = 0.02  # share of a limit within which a value counts as at it


def parameter_errors(summary: pd.DataFrame) -> pd.DataFrame:
    """Table 3: errors [%] of the identified parameters, mean and SD over seeds, beside the printed ones.

    Args:
        summary: rows of evaluation.csv of simulated cases.
    """
    rows = []
    for (dataset, recipe, scales), group in summary.groupby(["dataset", "recipe", "scales"]):
        for name in PARAMETERS:
            error = group[f"{name}_error_pct"]
            # The paper prints only 3-scale training.
            printed = printed_errors(dataset).get(name) if scales == 3 else None
            rows.append(
                {
                    "dataset": dataset,
                    "recipe": recipe,
                    "scales": scales,
                    "parameter": name,
                    "error_pct": error.mean(),
                    "sd_pct": error.std(ddof=0),
                    "paper_error_pct": printed[0] if printed else np.nan,
                    "paper_sd_pct": printed[1] if printed else np.nan,
                    "within_twice": bool(printed and abs(error.mean()) <= TWICE * abs(printed[0])),
                }
            )
    return pd.DataFrame(rows)


def printed_errors(dataset: str) -> Mapping[str, tuple[float, float]]:
    """Table 3 of the case that a dataset is, or is a further draw of: case1_again is one of case1."""
    return PRINTED_ERROR_PCT.get(dataset.split("_")[0], {})


def scores_by_scales(summary: pd.DataFrame) -> pd.DataFrame:
    """Table 4: test NMSE and R2, mean and SD over seeds, and the change against 1-scale training [%].

    Args:
        summary: rows of evaluation.csv.
    """
    rows = []
    for (dataset, recipe), group in summary.groupby(["dataset", "recipe"]):
        by_scales = group.groupby("scales")
        mean, sd = by_scales[["test_nmse", "test_r2"]].mean(), by_scales[["test_nmse", "test_r2"]].std(ddof=0)
        for scales in mean.index:
            nmse, r2 = PRINTED_TEST.get(scales, (np.nan, np.nan))
            rows.append(
                {
                    "dataset": dataset,
                    "recipe": recipe,
                    "scales": scales,
                    "test_nmse": mean["test_nmse"][scales],
                    "test_nmse_sd": sd["test_nmse"][scales],
                    "nmse_decrease_pct": 100 * (1 - mean["test_nmse"][scales] / mean["test_nmse"].iloc[0]),
                    "test_r2": mean["test_r2"][scales],
                    "test_r2_sd": sd["test_r2"][scales],
                    "paper_nmse": nmse,
                    "paper_r2": r2,
                }
            )
    return pd.DataFrame(rows)


def identified_values(summary: pd.DataFrame, identify: Mapping[str, Mapping[str, Any]]) -> pd.DataFrame:
    """Table 5: identified parameters, mean and SD over seeds, what the search could reach, and what the paper prints.

    Args:
        summary: rows of evaluation.csv.
        identify: {dataset: its section `identify`}.

    Returns:
        One row per dataset, number of scales and parameter. `at_limit`: seeds within 2 % of either limit.
    """
    rows = []
    for (dataset, scales), group in summary.groupby(["dataset", "scales"]):
        for name, (identified, literature) in PRINTED_VALUES.items():
            low, high = reach(identify[dataset][name])
            rows.append(
                {
                    "dataset": dataset,
                    "scales": scales,
                    "parameter": name,
                    "value": group[name].mean(),
                    "sd": group[name].std(ddof=0),
                    "reach_low": low,
                    "reach_high": high,
                    "at_limit": int(
                        ((group[name] < (1 + AT_LIMIT) * low) | (group[name] > (1 - AT_LIMIT) * high)).sum()
                    ),
                    "recorded_with": RECORDED_WITH[name],
                    "paper_value": identified[0],
                    "paper_sd": identified[1],
                    "paper_literature_low": literature[0],
                    "paper_literature_high": literature[1],
                }
            )
    return pd.DataFrame(rows)


def reach(wanted: Mapping[str, Any]) -> tuple[float, float]:
    """Values an entry of `identify` can take: (0, mean of the literature) with Eq. 41 as printed, or its bounds."""
    if wanted.get("literature"):
        return 0.0, float(np.mean(wanted["literature"]))
    return float(wanted["low"]), float(wanted["high"])


def true_values(summary: pd.DataFrame) -> dict[str, float]:
    """True values of `PARAMETERS`, from values and errors of a simulated case."""
    first = summary.iloc[0]
    return {name: float(first[name] / (1 + first[f"{name}_error_pct"] / 100)) for name in PARAMETERS}


def compare_choices(
    summary: pd.DataFrame,
    one_step: pd.DataFrame,
    histories: Mapping[str, pd.DataFrame],
    recipes: Mapping[str, Mapping[str, Any]],
) -> pd.DataFrame:
    """What each choice of the recipe does: scores, mean and SD over seeds, and parameters, root mean square over seeds.

    Args:
        summary: rows of evaluation.csv of one case, one recipe each.
        one_step: from `one_step.tabulate_one_step`.
        histories: {recipe: its history}.
        recipes: {recipe: its settings}, in the order of the rows.

    Returns:
        One row per recipe, in this order; `data_loss` [rad^2] and `weighted_residual` (beta J_res) of the last epoch.
    """
    rows = []
    for recipe, settings in recipes.items():
        runs = summary[summary["recipe"] == recipe]
        ahead = one_step.merge(runs[["dataset", "recipe", "scales", "seed"]])
        forced = ahead["test_r2_one_step"]
        history = histories[recipe]
        last = history[history["epoch"] == history["epoch"].max()]
        errors = runs[[f"{name}_error_pct" for name in PARAMETERS]]
        rows.append(
            {
                "recipe": recipe,
                **{key: settings[key] for key in CHOICES},
                "one_step_r2": forced.mean(),
                "one_step_r2_sd": forced.std(ddof=0),
                "test_r2": runs["test_r2"].mean(),
                "test_r2_sd": runs["test_r2"].std(ddof=0),
                "acceleration_share": ahead["acceleration_share"].mean(),
                "worst_error_pct": np.sqrt(errors.pow(2).mean()).max(),
                "data_loss": last["data_loss"].mean(),
                "weighted_residual": settings["beta"] * last["residual_loss"].mean(),
            }
        )
    return pd.DataFrame(rows)


def histories_by_dataset(paths: Iterable[str]) -> dict[str, dict[int, pd.DataFrame]]:
    """{dataset: {number of scales: its histories}} from paths {dataset}/{model}/{recipe}/{scales}-scale/{file}."""
    by_dataset: dict[str, list[str]] = {}
    for path in paths:
        by_dataset.setdefault(Path(path).parts[-5], []).append(path)
    return {dataset: read_histories(of_dataset) for dataset, of_dataset in by_dataset.items()}
