"""What the paper prints, and the same numbers as they come out here.

Source of all printed values: Taneja et al. 2023, Tables 3 to 5 (mean and standard deviation over seeds).
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd

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
CLEAR = 2.0  # standard errors from 0 from which a difference is more than the scatter of seeds


def parameter_errors(summary: pd.DataFrame) -> pd.DataFrame:
    """Table 3: errors [%] of the identified parameters, mean and SD over seeds, beside the printed ones.

    Args:
        summary: rows of evaluation.csv of simulated cases.
    """
    rows = []
    for (dataset, recipe, scales), group in summary.groupby(["dataset", "recipe", "scales"]):
        for name in PARAMETERS:
            error = group[f"{name}_error_pct"]
            # The paper prints 3-scale training alone.
            printed = PRINTED_ERROR_PCT.get(dataset, {}).get(name) if scales == 3 else None
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
                }
            )
    return pd.DataFrame(rows)


def scores_by_scales(summary: pd.DataFrame, printed: Mapping[int, tuple[float, float]] = PRINTED_TEST) -> pd.DataFrame:
    """Table 4: test NMSE and R2, mean and SD over seeds, and the change against 1-scale training [%].

    Args:
        summary: rows of evaluation.csv.
        printed: {scales: (NMSE, R2)}; {} where the paper prints none.
    """
    rows = []
    for (dataset, recipe), group in summary.groupby(["dataset", "recipe"]):
        by_scales = group.groupby("scales")
        mean, sd = by_scales[["test_nmse", "test_r2"]].mean(), by_scales[["test_nmse", "test_r2"]].std(ddof=0)
        for scales in mean.index:
            nmse, r2 = printed.get(scales, (np.nan, np.nan))
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


def identified_values(summary: pd.DataFrame) -> pd.DataFrame:
    """Table 5: identified parameters, mean and SD over seeds, beside the printed ones (another subject)."""
    rows = []
    for (dataset, scales), group in summary.groupby(["dataset", "scales"]):
        for name, (identified, literature) in PRINTED_VALUES.items():
            rows.append(
                {
                    "dataset": dataset,
                    "scales": scales,
                    "parameter": name,
                    "value": group[name].mean(),
                    "sd": group[name].std(ddof=0),
                    "paper_value": identified[0],
                    "paper_sd": identified[1],
                    "literature_low": literature[0],
                    "literature_high": literature[1],
                }
            )
    return pd.DataFrame(rows)


def judge_scales(summary: pd.DataFrame) -> pd.DataFrame:
    """Whether more scales help: test R2 of the most scales less that of 1-scale training, seed by seed.

    Returns:
        A row a dataset and recipe: mean difference, its standard error over seeds, seeds that gain, and the finding.
    """
    rows = []
    for (dataset, recipe), group in summary.groupby(["dataset", "recipe"]):
        wide = group.pivot(index="seed", columns="scales", values="test_r2")
        most = wide.columns.max()
        gain = (wide[most] - wide[wide.columns.min()]).to_numpy()
        error = gain.std(ddof=1) / np.sqrt(len(gain)) if len(gain) > 1 else np.nan
        clear = abs(gain.mean()) > CLEAR * error
        rows.append(
            {
                "dataset": dataset,
                "recipe": recipe,
                "scales": f"{most} against {wide.columns.min()}",
                "gain_r2": gain.mean(),
                "standard_error": error,
                "seeds_that_gain": f"{(gain > 0).sum()} of {len(gain)}",
                "finding": ("helps" if gain.mean() > 0 else "harms") if clear else "not more than the scatter of seeds",
            }
        )
    return pd.DataFrame(rows)


def write_page(cases: pd.DataFrame, derivatives: pd.DataFrame, subject: pd.DataFrame) -> str:
    """All tables as one page of Markdown.

    Args:
        cases: evaluations of Sec. 4.
        derivatives: of the case with either derivative in the residual.
        subject: of Sec. 5's protocol.
    """
    sections = {
        "Table 3: error of the identified parameters [%], mean and SD over seeds": parameter_errors(cases),
        "Test errors of Sec. 4 (the paper shows them as Fig. 8, without numbers)": scores_by_scales(cases, {}),
        "Derivatives along the sequence (paper) and by autodiff over t_n (paper_time)": parameter_errors(
            derivatives
        ).drop(columns=["paper_error_pct", "paper_sd_pct"]),
        "Table 4: test errors with Sec. 5's protocol; the paper's are of its own subject": scores_by_scales(subject),
        "Table 5: identified parameters; the paper's are of its own subject": identified_values(subject),
        "Do more scales help? Test R2 with the most scales less that with one, seed by seed": pd.concat(
            [judge_scales(cases), judge_scales(subject)]
        ),
    }
    parts = [f"## {heading}\n\n{_markdown(table)}\n" for heading, table in sections.items()]
    return "# The paper's own recipe, beside its printed values\n\n" + "\n".join(parts)


def _markdown(table: pd.DataFrame) -> str:
    lines = ["| " + " | ".join(table.columns) + " |", "|" + "---|" * len(table.columns)]
    for row in table.itertuples(index=False):
        lines.append("| " + " | ".join(_cell(value) for value in row) + " |")
    return "\n".join(lines)


def _cell(value: object) -> str:
    if isinstance(value, float):
        return "" if np.isnan(value) else f"{value:.4g}"
    return str(value)
