"""The paper's own recipe beside its printed values, as one page of Markdown."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from myowave.learning.paper.tables import (
    PARAMETERS,
    PRINTED_ERROR_PCT,
    PRINTED_TEST,
    judge_scales,
)

EXPLANATION = """\
Teacher forcing teaches one step ahead; a free run, the test mode of Fig. 4b, feeds every error back, hence the distance
between the two R2. These choices decide the rest:

- **Cell.** `paper_rnn` has the plain cell of Eqs. 8-10 in place of the GRU of Eqs. 11-13.
- **Derivative.** By autodiff over t_n, EMG and history are held fixed, so it is not the derivative of the motion. The
  network can lower the residual with any parameters, so that nothing keeps these from drifting as it trains.
- **Weight of the residual.** A one-step error e is about e/dt^2 in the acceleration, so with beta = dt^2 / I the
  residual counts I/dt^2 = 1000 times as much as the data (Eqs. 16-18 are not normalised). With beta = dt^4 / I^2 both
  are in rad^2.
- **Noise in the history.** Along the sequence the residual differentiates it twice. With the heavy weight it can be
  cheapest not to look at measured angles at all; with the light one the noise can still move parameters.
"""


def write_page(
    cases: pd.DataFrame,
    subject: pd.DataFrame,
    one_step: pd.DataFrame,
    errors: pd.DataFrame,
    choices: pd.DataFrame,
    values: pd.DataFrame,
    scores: pd.DataFrame,
) -> str:
    """All tables with what is seen in them.

    Args:
        cases, subject: evaluations of Secs. 4 and 5.
        one_step: test R2 with measured history, of all runs.
        errors, choices, values, scores: from `tables.parameter_errors` (Sec. 4), `compare_choices`,
            `identified_values` and `scores_by_scales` (Sec. 5).
    """
    judged = pd.concat([judge_scales(cases), judge_scales(subject)])
    seeds = cases["seed"].nunique()
    parts = [
        "# The paper's own recipe, beside its printed values",
        f"Taneja et al. 2023, Eqs. 11-18 as printed. Mean ± standard deviation over {seeds} seeds; R2 is of the unseen "
        "trial, running free unless it says *one step ahead*.",
        "## What is seen",
        "\n".join(f"- {finding}" for finding in _findings(errors, choices, values, scores, judged)),
        "## Table 3: error of the identified parameters [%], 3-scale training",
        _table(*_table3(errors)),
        "![errors beside Table 3](errors.png)",
        "## Fig. 8: test error by the number of scales (the paper prints no numbers)",
        _table(*_scores_of_cases(cases, one_step)),
        "![R2 by scales](scales.png)",
        "## What each choice does: case 1, 1-scale",
        _table(*_choices(choices)),
        EXPLANATION.strip(),
        "![parameters as training goes on, by derivative, weight and noise](derivatives.png)",
        "## Table 4: test errors with Sec. 5's protocol",
        "Three trials of `data/bench_elbow`, from another simulator; the paper's are of its own subject. At 100 Hz the "
        "last angle is nearly the next, so that teacher forcing can predict one step ahead almost without EMG.",
        _table(*_table4(scores, one_step)),
        "## Table 5: identified parameters, most scales",
        "Eq. 41 as printed confines a parameter to (0, mean of the literature values), true bounds to an interval "
        "around them. The trials were recorded with parameters that are known, but with other muscle curves.",
        _table(*_table5(values)),
        "## Do more scales help?",
        "Test R2 with the most scales less that of 1-scale training, seed by seed; a difference of more than two "
        "standard errors counts.",
        _table(*_judged(judged)),
    ]
    return "\n\n".join(parts) + "\n"


def _findings(
    errors: pd.DataFrame, choices: pd.DataFrame, values: pd.DataFrame, scores: pd.DataFrame, judged: pd.DataFrame
) -> list[str]:
    """What the tables say, in one sentence for each point."""
    verdicts = ", ".join(f"{what} in {count}" for what, count in judged["finding"].value_counts().items())
    worst = errors[errors["scales"] == 3]["error_pct"].abs().max()
    printed, best = choices.iloc[0], choices.loc[choices["worst_error_pct"].idxmin()]
    most = values[values["scales"] == values["scales"].max()]
    limits = most.groupby("dataset")["at_limit"].sum()
    by_dataset = "; ".join(
        f"{group['test_r2'].iloc[0]:.3f} with 1 scale and {group['test_r2'].iloc[-1]:.3f} with "
        f"{group['scales'].iloc[-1]} in `{dataset}`"
        for dataset, group in scores.groupby("dataset")
    )
    return [
        f"More scales, the most against one, in {len(judged)} datasets: {verdicts}.",
        f"R2 as printed (case 1, 1-scale): {printed['one_step_r2']:.3f} one step ahead, {printed['test_r2']:.3f} free.",
        f"Parameters as printed (3-scale): mean error of up to {worst:.3g} %; the paper prints up to 0.5 %. Root mean "
        f"square over seeds, 1-scale of case 1: {printed['worst_error_pct']:.3g} % as printed, "
        f"{best['worst_error_pct']:.3g} % with `{best['recipe']}`.",
        f"Sec. 5: R2 {by_dataset}; the paper's subject: {PRINTED_TEST[1][1]} with 1 and {PRINTED_TEST[4][1]} with 4.",
        "Identified values at a limit of their reach, of all seeds and parameters: "
        + ", ".join(f"{count} in `{dataset}`" for dataset, count in limits.items())
        + ".",
    ]


def _table3(errors: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    three = errors[errors["scales"] == 3].set_index(["dataset", "parameter"])
    cases = sorted(three.index.get_level_values("dataset").unique())
    header = ["parameter", *(f"{case}{who}" for case in cases for who in ("", ", paper"))]
    rows = []
    for name in PARAMETERS:
        row = [name]
        for case in cases:
            here, printed = three.loc[(case, name)], PRINTED_ERROR_PCT[case][name]
            row += [_pm(here["error_pct"], here["sd_pct"], 2), _pm(*printed, 2)]
        rows.append(row)
    return header, rows


def _scores_of_cases(cases: pd.DataFrame, one_step: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    header = ["case", "scales", "R2 running free", "R2 one step ahead", "MSE [rad²]"]
    merged = cases.merge(one_step, on=["dataset", "recipe", "scales", "seed"])
    rows = [
        [
            dataset,
            str(scales),
            *(_over_seeds(group[column], 3) for column in ("test_r2", "test_r2_one_step")),
            _over_seeds(group["test_mse"], 4),
        ]
        for (dataset, scales), group in merged.groupby(["dataset", "scales"])
    ]
    return header, rows


def _choices(choices: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    header = [
        "recipe",
        "cell",
        "derivative",
        "beta",
        "noise [rad]",
        "epochs",
        "R2 one step ahead",
        "R2 running free",
        "worst parameter, rms [%]",
        "J_data [rad²]",
        "beta J_res",
    ]
    rows = [
        [
            f"`{row.recipe}`",
            row.cell.upper(),
            "t_n" if row.derivative == "time" else "sequence",
            f"{row.beta:.0e}",
            f"{row.history_noise:g}",
            str(row.epochs),
            _pm(row.one_step_r2, row.one_step_r2_sd, 3),
            _pm(row.test_r2, row.test_r2_sd, 3),
            f"{row.worst_error_pct:.1f}",
            f"{row.data_loss:.1e}",
            f"{row.weighted_residual:.1e}",
        ]
        for row in choices.itertuples()
    ]
    return header, rows


def _table4(scores: pd.DataFrame, one_step: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    datasets = sorted(scores["dataset"].unique(), reverse=True)
    forced = one_step.set_index(["dataset", "scales"]).sort_index()["test_r2_one_step"]
    header = ["scales", "paper: NMSE", "paper: R2"]
    for dataset in datasets:
        header += [f"{dataset}: NMSE", "change", "R2", "R2 one step ahead"]
    rows = []
    for scales, group in scores.groupby("scales"):
        nmse, r2 = PRINTED_TEST.get(scales, (np.nan, np.nan))
        row = [str(scales), _number(nmse, ".2e"), _number(r2, ".3f")]
        for dataset in datasets:
            of_dataset = group[group["dataset"] == dataset]
            if of_dataset.empty:
                row += [""] * 4
                continue
            here = of_dataset.iloc[0]
            row += [
                f"{here['test_nmse']:.2e} ± {here['test_nmse_sd']:.1e}",
                f"{0 - here['nmse_decrease_pct']:+.0f} %",
                _pm(here["test_r2"], here["test_r2_sd"], 3),
                _over_seeds(forced.loc[(dataset, scales)], 3),
            ]
        rows.append(row)
    return header, rows


def _table5(values: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    most = values[values["scales"] == values["scales"].max()]
    datasets = sorted(most["dataset"].unique(), reverse=True)
    header = ["parameter", "recorded with"]
    for dataset in datasets:
        header += [f"{dataset}: reach", "identified", "seeds at a limit"]
    header += ["paper's subject", "literature, paper"]
    rows = []
    for name, group in most.groupby("parameter", sort=False):
        digits = 3 if name.startswith("l0") else 0
        row = [f"{name} [{'m' if digits else 'N'}]", f"{group['recorded_with'].iloc[0]:g}"]
        for dataset in datasets:
            here = group[group["dataset"] == dataset].iloc[0]
            row += [
                f"{here['reach_low']:.{digits}f} - {here['reach_high']:.{digits}f}",
                _pm(here["value"], here["sd"], digits),
                str(here["at_limit"]),
            ]
        first = group.iloc[0]
        row += [
            f"{first['paper_value']:g} ± {first['paper_sd']:g}",
            f"{first['paper_literature_low']:g} - {first['paper_literature_high']:g}",
        ]
        rows.append(row)
    return header, rows


def _judged(judged: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    header = ["dataset", "scales", "change of R2 ± standard error", "seeds that gain", "finding"]
    rows = [
        [row.dataset, row.scales, _pm(row.gain_r2, row.standard_error, 3), row.seeds_that_gain, row.finding]
        for row in judged.itertuples()
    ]
    return header, rows


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    assert all(len(row) == len(header) for row in rows)
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _over_seeds(values: pd.Series, digits: int) -> str:
    return _pm(values.mean(), values.std(ddof=0), digits)


def _pm(mean: float, spread: float, digits: int) -> str:
    return f"{mean:.{digits}f} ± {spread:.{digits}f}"


def _number(value: float, form: str) -> str:
    return "" if np.isnan(value) else format(value, form)
