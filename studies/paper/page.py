"""The paper's own recipe beside its printed values, as one page of Markdown."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from myowave.learning.tables import judge_scales
from studies.paper.tables import PARAMETERS, PRINTED_TEST

Rows = Sequence[Mapping[str, str]]
"""A table: its rows, {column: cell}, all with the same columns."""

EXPLANATION = """\
Teacher forcing teaches one step ahead; a free run, the test mode of Fig. 4b, feeds every error back, hence the
distance between the two R2. These choices decide the rest:

- **History.** EMG moves the arm 80 ms later, which is 2.5 samples of 31.6 ms: with 2 history steps no network can
  see what moves it. `paper_two_steps` and `paper_delayed`, which sees e(t - d), differ in this alone.
- **Torque.** Where EMG is rough the second difference of the motion is a mean over two samples, and the torque of
  one instant is not: see *On perfect angles*.
- **Angles of the residual.** Along predictions every acceleration that the network does not foresee is taken for
  weaker muscles (*accelerations seen*). `split` teaches the weights along predictions and the parameters along
  measured motion.
- **Derivative.** By autodiff over t_n, EMG and history are held fixed, so it is not the derivative of the motion.
  The network can lower the residual with any parameters, so that nothing keeps these from drifting as it trains.
- **Weight of the residual.** A one-step error e is about e/dt^2 in the acceleration, so with beta = dt^2 / I the
  residual counts I/dt^2 = 1000 times as much as the data (Eqs. 16-18 are not normalised). With beta = dt^4 / I^2
  both are in rad^2.
- **Steps of Adam.** Force and length of a muscle do nearly the same; at 0.001 a step the parameters take about 3000
  steps to settle even along perfect angles. `parameter_pace` and mini-batches make that affordable.
- **Cell.** With the plain cell of Eqs. 8-10 in place of the GRU of Eqs. 11-13 the recipe as printed came to 0.938 one
  step ahead and 0.851 running free, and its worst parameter to 24 % (2026-11, no longer run): as with the GRU.
"""


def write_page(
    cases: pd.DataFrame,
    subject: pd.DataFrame,
    one_step: pd.DataFrame,
    errors: pd.DataFrame,
    choices: pd.DataFrame,
    values: pd.DataFrame,
    scores: pd.DataFrame,
    bias: pd.DataFrame,
    best: str,
) -> str:
    """All tables with what is seen in them.

    Args:
        cases, subject: evaluations of Secs. 4 and 5.
        one_step: test R2 with measured history, of all runs.
        errors, choices, values, scores: from `tables.parameter_errors` (Sec. 4), `compare_choices`,
            `identified_values` and `scores_by_scales` (Sec. 5).
        bias: from `bias.tabulate_bias`.
        best: name of the recipe that reads the paper best; the other recipe of `cases` is as printed.
    """
    printed = cases[cases["recipe"] != best]
    judged = pd.concat([judge_scales(cases), judge_scales(subject)])
    seeds = cases["seed"].nunique()
    parts = [
        "# The paper's own recipe, beside its printed values",
        f"Taneja et al. 2023. Mean ± standard deviation over {seeds} seeds; R2 is of the unseen trial, running free "
        f"unless it says *one step ahead*. `{printed['recipe'].iloc[0]}` is Eqs. 11-18 as printed, `{best}` the same "
        "with what the paper leaves open read so that it comes out (*What each choice does*).",
        "## What is seen",
        "\n".join(f"- {finding}" for finding in _findings(errors, choices, values, scores, judged, cases, best)),
        f"## Table 3 with `{best}`: error of the identified parameters [%], 3-scale training",
        "Datasets other than case1 to case3 are further draws of theirs.",
        _table(_table3(errors[errors["recipe"] == best])),
        "## Table 3 as printed",
        _table(_table3(errors[errors["recipe"] != best])),
        "![errors beside Table 3](paper_errors.png)",
        "## On perfect angles: what the residual itself finds, without any network [%]",
        "Parameters of the least J_res along the measured motion of the training trials. In "
        "case1_sampled the motion obeys the sampled equation; EMG is cut off at 0 and 1, where the noise goes beyond.",
        _table(_bias(bias)),
        "## Fig. 8: test error by the number of scales (the paper prints no numbers)",
        _table(_scores_of_cases(cases, one_step)),
        "![R2 by scales](paper_scales.png)",
        f"![error by step of Adam with {best}](paper_convergence.png)",
        "## What each choice does: case 1, 1-scale",
        _table(_choices(choices)),
        EXPLANATION.strip(),
        "![parameters as training goes on, by choice](paper_derivatives.png)",
        "## Table 4: test errors with Sec. 5's protocol",
        "Three trials of `data/bench_elbow`, from another simulator; the paper's are of its own subject, so nothing is "
        "to be read from the distance to its numbers. At 100 Hz the last angle is nearly the next, so that teacher "
        "forcing can predict one step ahead almost without EMG.",
        _table(_table4(scores, one_step)),
        "## Table 5: identified parameters, most scales",
        "Eq. 41 as printed confines a parameter to (0, mean of the literature values), true bounds to an interval "
        "around them. The trials were recorded with parameters that are known, but with other muscle curves.",
        _table(_table5(values)),
        "## Do more scales help?",
        "Test R2 with the most scales less that of 1-scale training, seed by seed; a difference of more than two "
        "standard errors counts.",
        _table(_judged(judged)),
    ]
    return "\n\n".join(parts) + "\n"


def _findings(
    errors: pd.DataFrame,
    choices: pd.DataFrame,
    values: pd.DataFrame,
    scores: pd.DataFrame,
    judged: pd.DataFrame,
    cases: pd.DataFrame,
    best: str,
) -> list[str]:
    """What the tables say, in one sentence for each point."""
    verdicts = ", ".join(f"{what} in {count}" for what, count in judged["finding"].value_counts().items())
    three = errors[errors["scales"] == 3]
    of_best, as_printed = three[three["recipe"] == best], three[three["recipe"] != best]
    printed = choices.iloc[0]
    most = values[values["scales"] == values["scales"].max()]
    limits = most.groupby("dataset")["at_limit"].sum()
    r2 = cases.groupby("recipe")["test_r2"].min()
    outside = of_best[~of_best["within_twice"]]
    worst, within = of_best["error_pct"].abs().max(), of_best["within_twice"].sum()
    beyond = ", ".join(f"{row.parameter} in {row.dataset} ({row.error_pct:.3f} %)" for row in outside.itertuples())
    by_dataset = "; ".join(
        f"{group['test_r2'].iloc[0]:.3f} with 1 scale and {group['test_r2'].iloc[-1]:.3f} with "
        f"{group['scales'].iloc[-1]} in `{dataset}`"
        for dataset, group in scores.groupby("dataset")
    )
    return [
        f"Table 3 with `{best}`: {within} of {len(of_best)} mean errors are within twice those printed; the largest is "
        f"{worst:.2g} %." + (f" Beyond: {beyond}." if beyond else ""),
        f"Running free on the unseen trial every seed of `{best}` has R2 of at least {r2[best]:.3f}, with any number "
        f"of scales; as printed {r2.drop(best).min():.3f}.",
        f"More scales, the most against one, in {len(judged)} pairs of dataset and recipe: {verdicts}.",
        f"R2 as printed (case 1, 1-scale): {printed['one_step_r2']:.3f} one step ahead, {printed['test_r2']:.3f} free. "
        f"Parameters as printed (3-scale): mean error of up to {as_printed['error_pct'].abs().max():.3g} %.",
        f"Sec. 5 as printed: R2 {by_dataset}. (Another arm than the paper's subject, who is a person.)",
        "Identified values at a limit of their reach, of all seeds and parameters: "
        + ", ".join(f"{count} in `{dataset}`" for dataset, count in limits.items())
        + ".",
    ]


def _table3(errors: pd.DataFrame) -> Rows:
    three = errors[errors["scales"] == 3].set_index(["dataset", "parameter"]).sort_index()
    rows = []
    for dataset in three.index.unique("dataset"):
        here = three.loc[dataset].loc[list(PARAMETERS)]
        row = {"dataset": dataset}
        for name, r in here.iterrows():
            row |= {f"{name}": _pm(r["error_pct"], r["sd_pct"], 3)}
            row |= {f"{name}, paper": _pm(r["paper_error_pct"], r["paper_sd_pct"], 2)}
        rows.append(row | {"within twice": f"{here['within_twice'].sum()} of {len(here)}"})
    return rows


def _bias(bias: pd.DataFrame) -> Rows:
    return [
        {"dataset": r["dataset"], "torque": r["torque"], **{name: f"{r[name]:+.3f}" for name in PARAMETERS}}
        for _, r in bias.iterrows()
    ]


def _scores_of_cases(cases: pd.DataFrame, one_step: pd.DataFrame) -> Rows:
    merged = cases.merge(one_step, on=["dataset", "recipe", "scales", "seed"])
    return [
        {
            "recipe": f"`{recipe}`",
            "case": dataset,
            "scales": str(scales),
            "R2 running free": _over_seeds(group["test_r2"], 3),
            "lowest seed": f"{group['test_r2'].min():.3f}",
            "R2 one step ahead": _over_seeds(group["test_r2_one_step"], 4),
            "MSE [rad²]": _over_seeds(group["test_mse"], 4),
        }
        for (recipe, dataset, scales), group in merged.groupby(["recipe", "dataset", "scales"])
    ]


def _choices(choices: pd.DataFrame) -> Rows:
    return [
        {
            "recipe": f"`{row.recipe}`",
            "history": str(row.history_steps),
            "EMG": row.emg_input,
            "residual": row.residual,
            "beta": f"{row.beta:.0e}",
            "noise [rad]": f"{row.history_noise:g}",
            "steps": str(row.epochs * row.batches),
            "R2 one step ahead": _pm(row.one_step_r2, row.one_step_r2_sd, 4),
            "R2 running free": _pm(row.test_r2, row.test_r2_sd, 3),
            "accelerations seen": f"{100 * row.acceleration_share:.0f} %",
            "worst parameter, rms [%]": f"{row.worst_error_pct:.2g}",
        }
        for row in choices.itertuples()
    ]


def _table4(scores: pd.DataFrame, one_step: pd.DataFrame) -> Rows:
    forced = one_step.set_index(["dataset", "scales"]).sort_index()["test_r2_one_step"]
    rows = []
    for number, group in scores.groupby("scales"):
        nmse, r2 = PRINTED_TEST.get(number, (np.nan, np.nan))
        row = {"scales": str(number), "paper: NMSE": _number(nmse, ".2e"), "paper: R2": _number(r2, ".3f")}
        by_dataset = group.set_index("dataset")
        for dataset in sorted(scores["dataset"].unique(), reverse=True):
            trained = dataset in by_dataset.index
            here = by_dataset.loc[dataset] if trained else {}
            row |= {
                f"{dataset}: NMSE": f"{here['test_nmse']:.2e} ± {here['test_nmse_sd']:.1e}" if trained else "",
                f"{dataset}: change": f"{0 - here['nmse_decrease_pct']:+.0f} %" if trained else "",
                f"{dataset}: R2": _pm(here["test_r2"], here["test_r2_sd"], 3) if trained else "",
                f"{dataset}: R2 one step ahead": _over_seeds(forced.loc[(dataset, number)], 3) if trained else "",
            }
        rows.append(row)
    return rows


def _table5(values: pd.DataFrame) -> Rows:
    most = values[values["scales"] == values["scales"].max()]
    rows = []
    for name, group in most.groupby("parameter", sort=False):
        digits = 3 if name.startswith("l0") else 0
        by_dataset, first = group.set_index("dataset").sort_index(ascending=False), group.iloc[0]
        row = {"parameter": f"{name} [{'m' if digits else 'N'}]", "recorded with": f"{first['recorded_with']:g}"}
        for dataset, here in by_dataset.iterrows():
            row |= {
                f"{dataset}: reach": f"{here['reach_low']:.{digits}f} - {here['reach_high']:.{digits}f}",
                f"{dataset}: identified": _pm(here["value"], here["sd"], digits),
                f"{dataset}: seeds at a limit": str(here["at_limit"]),
            }
        row["paper's subject"] = f"{first['paper_value']:g} ± {first['paper_sd']:g}"
        row["literature, paper"] = f"{first['paper_literature_low']:g} - {first['paper_literature_high']:g}"
        rows.append(row)
    return rows


def _judged(judged: pd.DataFrame) -> Rows:
    return [
        {
            "dataset": row.dataset,
            "recipe": f"`{row.recipe}`",
            "scales": row.scales,
            "change of R2 ± standard error": _pm(row.gain_r2, row.standard_error, 3),
            "seeds that gain": row.seeds_that_gain,
            "finding": row.finding,
        }
        for row in judged.itertuples()
    ]


def _table(rows: Rows) -> str:
    header = list(rows[0])
    assert all(list(row) == header for row in rows)
    lines = [header, ["---"] * len(header), *(row.values() for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _over_seeds(values: pd.Series, digits: int) -> str:
    return _pm(values.mean(), values.std(ddof=0), digits)


def _pm(mean: float, spread: float, digits: int) -> str:
    return f"{mean:.{digits}f} ± {spread:.{digits}f}"


def _number(value: float, form: str) -> str:
    return "" if np.isnan(value) else format(value, form)
