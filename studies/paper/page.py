"""The paper's own recipe beside its printed values, as one page of Markdown."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from myowave.learning.tables import judge_scales
from studies.paper.tables import PARAMETERS, PRINTED_TEST, PRINTED_VALUES, RECORDED_WITH
from studies.shared import markdown

PERFECT_ANGLES = """\
Parameters of the least J_res along the true motion of the training trials of the five draws of the cases (2026-11, no
longer run), off by, at most [%]:

| torque | f0_Bi | f0_Tri | l0_Bi | l0_Tri |
| --- | --- | --- | --- | --- |
| sampled | 3.828 | 4.647 | 0.176 | 0.198 |
| averaged | 0.021 | 0.035 | 0.008 | 0.002 |

Along a motion that obeys the sampled equation it is the other way round: 0.000 % sampled, and up to 3.6 % averaged."""
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
  step ahead and 0.851 running free, and its worst parameter to 24 % (2026-11, no longer run): as with the GRU."""


def write_page(
    cases: pd.DataFrame,
    subject: pd.DataFrame,
    chosen: pd.DataFrame,
    errors: pd.DataFrame,
    values: pd.DataFrame,
    recipes: Mapping[str, Mapping[str, Any]],
    best: str,
) -> str:
    """All tables with what is seen in them.

    Args:
        cases, subject: evaluations of Secs. 4 and 5, with columns of `one_step.tabulate_one_step`.
        chosen: the same of one case, with one run of each of `recipes`.
        errors, values: from `tables.parameter_errors` and `tables.identified_values`.
        recipes: {recipe: its settings}, the one as printed first.
        best: name of the recipe that reads the paper best; the other recipe of `cases` is as printed.
    """
    printed = next(iter(recipes))
    judged = pd.concat([judge_scales(cases), judge_scales(subject)])
    parts = [
        "# The paper's own recipe, beside its printed values",
        f"Taneja et al. 2023. Mean ± standard deviation over {cases['seed'].nunique()} seeds; R2 is of the unseen "
        f"trial, running free unless it says *one step ahead*. `{printed}` is Eqs. 11-18 as printed, `{best}` the same "
        "with what the paper leaves open read so that it comes out (*What each choice does*).",
        "## What is seen",
        "\n".join(f"- {finding}" for finding in _findings(cases, subject, chosen, errors, values, judged, best)),
        f"## Table 3 with `{best}`: error of the identified parameters [%], 3-scale training",
        "Datasets other than case1 to case3 are further draws of theirs.",
        _errors(errors[errors["recipe"] == best]),
        "## Table 3 as printed",
        _errors(errors[errors["recipe"] == printed]),
        "![errors beside Table 3](paper_errors.png)",
        "## On perfect angles: what the residual itself finds, without any network",
        PERFECT_ANGLES,
        "## Fig. 8: test error by the number of scales (the paper prints no numbers)",
        _scores(cases),
        "![R2 by scales](paper_scales.png)",
        f"![error by step of Adam with {best}](paper_convergence.png)",
        "## What each choice does: case 1, 1-scale",
        _choices(chosen, recipes),
        EXPLANATION,
        "## Table 4: test errors with Sec. 5's protocol",
        "Three trials of `data/bench_elbow`, from another simulator; the paper's are of its own subject, so nothing is "
        "to be read from the distance to its numbers. At 100 Hz the last angle is nearly the next, so that teacher "
        "forcing can predict one step ahead almost without EMG.",
        _scores(subject, PRINTED_TEST),
        "## Table 5: identified parameters, most scales",
        "Eq. 41 as printed confines a parameter to (0, mean of the literature values), true bounds to an interval "
        "around them. The trials were recorded with parameters that are known, but with other muscle curves.",
        _values(values),
        "## Do more scales help?",
        "Test R2 with the most scales less that of 1-scale training, seed by seed; a difference of more than two "
        "standard errors counts.",
        _judged(judged),
    ]
    return "\n\n".join(parts) + "\n"


def _findings(
    cases: pd.DataFrame,
    subject: pd.DataFrame,
    chosen: pd.DataFrame,
    errors: pd.DataFrame,
    values: pd.DataFrame,
    judged: pd.DataFrame,
    best: str,
) -> list[str]:
    """What the tables say, in one sentence for each point."""
    of_best, as_printed = errors[errors["recipe"] == best], errors[errors["recipe"] != best]
    beyond = of_best[~of_best["within_twice"]]
    named = _listed(f"{row.parameter} in {row.dataset} ({row.error_pct:.3f} %)" for row in beyond.itertuples())
    lowest = cases.groupby("recipe")["test_r2"].min()
    printed = chosen[chosen["recipe"].isin(as_printed["recipe"])]
    r2 = subject.groupby(["dataset", "scales"])["test_r2"].mean().unstack()
    of_subject = (
        f"{row.iloc[0]:.3f} with 1 scale and {row.iloc[-1]:.3f} with {r2.columns[-1]} in `{dataset}`"
        for dataset, row in r2.iterrows()
    )
    verdicts = _listed(f"{what} in {count}" for what, count in judged["finding"].value_counts().items())
    limits = values.groupby("dataset")["at_limit"].sum()
    return [
        f"Table 3 with `{best}`: {of_best['within_twice'].sum()} of {len(of_best)} mean errors are within twice those "
        f"printed; the largest is {of_best['error_pct'].abs().max():.2g} %." + (f" Beyond: {named}" if named else ""),
        f"Running free on the unseen trial every seed of `{best}` has R2 of at least {lowest[best]:.3f}, with any "
        f"number of scales; as printed {lowest.drop(best).min():.3f}.",
        f"More scales, the most against one, in {len(judged)} pairs of dataset and recipe: {verdicts}",
        f"R2 as printed (case 1, 1-scale): {printed['test_r2_one_step'].mean():.3f} one step ahead, "
        f"{printed['test_r2'].mean():.3f} free. Parameters as printed (3-scale): mean error of up to "
        f"{as_printed['error_pct'].abs().max():.3g} %.",
        f"Sec. 5 as printed: R2 {_listed(of_subject)} (Another arm than the paper's subject, who is a person.)",
        "Identified values at a limit of their reach, of all seeds and parameters: "
        + _listed(f"{count} in `{dataset}`" for dataset, count in limits.items()),
    ]


def _errors(errors: pd.DataFrame) -> str:
    rows = []
    for dataset, group in errors.groupby("dataset"):
        row = {"dataset": dataset}
        for r in group.itertuples():
            row[r.parameter] = _spread(r.error_pct, r.sd_pct, 3)
            row[f"{r.parameter}, paper"] = _spread(r.paper_error_pct, r.paper_sd_pct, 2)
        rows.append(row | {"within twice": f"{group['within_twice'].sum()} of {len(group)}"})
    return _table(rows)


def _scores(runs: pd.DataFrame, printed: Mapping[int, tuple[float, float]] = {}) -> str:
    rows = []
    for (recipe, dataset, scales), group in runs.groupby(["recipe", "dataset", "scales"]):
        row = {
            "recipe": f"`{recipe}`",
            "dataset": dataset,
            "scales": scales,
            "R2 running free": _over_seeds(group["test_r2"], 3),
            "lowest seed": f"{group['test_r2'].min():.3f}",
            "R2 one step ahead": _over_seeds(group["test_r2_one_step"], 4),
        }
        if printed:
            nmse, r2 = printed.get(scales, (np.nan, np.nan))
            row["NMSE"] = f"{group['test_nmse'].mean():.2e} ± {group['test_nmse'].std(ddof=0):.1e}"
            row |= {"paper: R2": _number(r2, ".3f"), "paper: NMSE": _number(nmse, ".2e")}
        else:
            row["MSE [rad²]"] = _over_seeds(group["test_mse"], 4)
        rows.append(row)
    return _table(rows)


def _choices(chosen: pd.DataFrame, recipes: Mapping[str, Mapping[str, Any]]) -> str:
    rows = []
    for recipe, settings in recipes.items():
        runs = chosen[chosen["recipe"] == recipe]
        worst = np.sqrt(runs[[f"{name}_error_pct" for name in PARAMETERS]].pow(2).mean()).max()
        rows.append(
            {
                "recipe": f"`{recipe}`",
                "history": settings["history_steps"],
                "EMG": settings["emg_input"],
                "residual": settings["residual"],
                "beta": f"{settings['beta']:.0e}",
                "noise [rad]": f"{settings['history_noise']:g}",
                "steps": settings["epochs"] * settings["batches"],
                "R2 one step ahead": _over_seeds(runs["test_r2_one_step"], 4),
                "R2 running free": _over_seeds(runs["test_r2"], 3),
                "accelerations seen": f"{100 * runs['acceleration_share'].mean():.0f} %",
                "worst parameter, rms [%]": f"{worst:.2g}",
            }
        )
    return _table(rows)


def _values(values: pd.DataFrame) -> str:
    rows = []
    for name, group in values.groupby("parameter", sort=False):
        digits = 3 if name.startswith("l0") else 0
        row = {"parameter": f"{name} [{'m' if digits else 'N'}]", "recorded with": f"{RECORDED_WITH[name]:g}"}
        for r in group.itertuples():
            row[f"{r.dataset}: reach"] = f"{r.low:.{digits}f} - {r.high:.{digits}f}"
            row[f"{r.dataset}: identified"] = _spread(r.value, r.sd, digits)
            row[f"{r.dataset}: seeds at a limit"] = r.at_limit
        (mean, sd), (low, high) = PRINTED_VALUES[name]
        rows.append(row | {"paper's subject": f"{mean:g} ± {sd:g}", "literature, paper": f"{low:g} - {high:g}"})
    return _table(rows)


def _judged(judged: pd.DataFrame) -> str:
    return _table(
        {
            "dataset": row.dataset,
            "recipe": f"`{row.recipe}`",
            "scales": row.scales,
            "change of R2 ± standard error": _spread(row.gain_r2, row.standard_error, 3),
            "seeds that gain": row.seeds_that_gain,
            "finding": row.finding,
        }
        for row in judged.itertuples()
    )


def _table(rows: Iterable[Mapping[str, object]]) -> str:
    """Rows that are all {column: cell} with the same columns."""
    table = pd.DataFrame(rows).astype(str)
    return markdown(table.columns, table.to_numpy())


def _listed(parts: Iterable[str]) -> str:
    """A sentence's list with its full stop; nothing of nothing."""
    found = "; ".join(parts)
    return found and f"{found}."


def _over_seeds(values: pd.Series, digits: int) -> str:
    return _spread(values.mean(), values.std(ddof=0), digits)


def _spread(mean: float, spread: float, digits: int) -> str:
    return f"{mean:.{digits}f} ± {spread:.{digits}f}"


def _number(value: float, form: str) -> str:
    return "" if np.isnan(value) else format(value, form)
