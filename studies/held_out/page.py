"""What was found, as tables and a picture: how far methods err by question, and what physics and scales change."""

from collections.abc import Iterator

import pandas as pd
from matplotlib.figure import Figure
from scipy import stats

from myowave.plotting import CYCLE, canvas, title
from myowave.scores import TITLES
from studies.shared import markdown

SCORE = "test_r2"
# Not of the lean: one trial alone leans more than all others, so its differences have no interval.
QUESTIONS = {"like_the_others": "like the others", "unseen_load": "unseen load", "few_trials": "1 to 4 trials"}
INPUTS = {"given": "load given", "weighed": "EMG over weight"}


def by_question(rows: pd.DataFrame) -> str:
    """R2 of every method, its load given and with EMG over weight, means over test trials and seeds; the best bold."""
    few = rows["question"].eq("few_trials")
    asked = rows["split"].where(rows["question"].eq("unseen_load"), rows["question"].str.replace("_", " "))
    asked = asked.mask(few, rows["split"].str.rsplit(n=1).str[0])
    order = list(dict.fromkeys(asked))
    keys = ["inputs", "method", "scales"]
    found = rows.assign(asked=asked).pivot_table(index=keys, columns="asked", values=SCORE, sort=False)[order]
    best = found.round(3).eq(found.round(3).max())
    lines = [
        [_method(*key), *(f"**{r2:.3f}**" if best.loc[key, name] else f"{r2:.3f}" for name, r2 in scores.items())]
        for key, scores in found.iterrows()
        if key[:2] != ("weighed", "hold")  # which sees no EMG
    ]
    return markdown(["method", *order], lines)


def _method(inputs: str, method: str, scales: int) -> str:
    name = TITLES.get(method, f"network, {scales} scale{'s' * (scales > 1)}")
    return name if method == "hold" else f"{name}, {INPUTS[inputs]}"


def differences(rows: pd.DataFrame) -> str:
    """Changes of the error that choices make, mean and 95 % interval over test trials."""
    found = list(_differences(rows))
    lines = [[name, *(_with_interval(change) for change in changes)] for name, changes in found]
    counts = [len(change) for change in found[0][1]]
    return markdown(["change", *(f"{name} ({n})" for name, n in zip(QUESTIONS.values(), counts, strict=True))], lines)


def _with_interval(change: pd.Series) -> str:
    low, high = interval(change)
    text = f"{change.mean():+.2f} ({low:+.2f} to {high:+.2f})"
    return f"**{text}**" if low > 0 or high < 0 else text


def lowest(rows: pd.DataFrame) -> dict[str, float]:
    """The lowest R2 on any trial and by any seed of the network with 1 scale and EMG over weight, by what was held out
    of the loads."""
    mine = rows["inputs"].eq("weighed") & ~rows["method"].isin(TITLES) & rows["scales"].eq(1)
    own = rows[mine & rows["question"].eq("unseen_load")]
    return {str(split): float(r2) for split, r2 in own.groupby("split")[SCORE].min().items()}


def interval(change: pd.Series) -> tuple[float, float]:
    """Holds the mean of paired differences with probability .95 (Student's t)."""
    low, high = stats.ttest_1samp(change, 0.0).confidence_interval(0.95)
    return float(low), float(high)


def _differences(rows: pd.DataFrame) -> Iterator[tuple[str, list[pd.Series]]]:
    """What is changed, and by how much that changes the error of each test trial [deg], seeds averaged, for each
    question."""
    keys = ["question", "inputs", "method", "scales", "trial"]  # one that several splits test counts once
    error = rows.groupby(keys)["test_rmse_deg"].mean()
    (network,) = set(rows["method"]) - set(TITLES)
    scales = sorted(rows.loc[rows["method"] == network, "scales"].unique())

    def of(question: str, inputs: str, method: str, count: int) -> pd.Series:
        return error.loc[question, inputs, method, count]

    def best_baseline(question: str) -> pd.Series:
        means = error.loc[question].groupby(["inputs", "method", "scales"]).mean().drop(network, level="method")
        return of(question, *means.idxmin())

    own = {q: of(q, "weighed", network, 1) for q in QUESTIONS}
    yield "the network for the best baseline", [own[q] - best_baseline(q) for q in QUESTIONS]
    yield "EMG over weight for the load given", [own[q] - of(q, "given", network, 1) for q in QUESTIONS]
    for inputs, text in reversed(INPUTS.items()):
        for count in scales[1:]:
            changes = [of(q, inputs, network, count) - of(q, inputs, network, 1) for q in QUESTIONS]
            yield f"{count} scales for 1, {text}", changes


def draw_differences(rows: pd.DataFrame) -> Figure:
    """The same as a picture."""
    found = list(_differences(rows))
    size = {"width": 11, "height": 1.6 + 0.36 * len(found)}
    figure, axes = canvas(1, len(QUESTIONS), **size, sharex=True, sharey=True)
    for axis, name, changes in zip(axes[0], QUESTIONS.values(), zip(*(c for _, c in found), strict=True), strict=True):
        for place, change in enumerate(changes):
            low, high = interval(change)
            colour = CYCLE[min(place, 2)]
            axis.plot([low, high], [place, place], color=colour, linewidth=2)
            axis.plot(change.mean(), place, "o", color=colour)
        axis.axvline(0, color="black", linewidth=1)
        axis.set_title(f"{name}, {len(changes[0])} tests", loc="left")
        axis.set_xlabel("change of the error [deg]")
    axes[0, 0].set_yticks(range(len(found)), [text for text, _ in found])
    axes[0, 0].invert_yaxis()
    network, physics = ([c.mean() for c in changes] for _, changes in found[:2])
    helped = any(interval(change)[1] < 0 for _, changes in found[2:] for change in changes)
    scales = f"more scales help {'somewhere' if helped else 'nowhere'} for sure"
    title(
        figure,
        f"On a load that no trial had the network errs {-network[1]:.1f} deg less than the best baseline,\n"
        f"EMG over weight saves it {-physics[1]:.1f} deg; {scales}",
    )
    return figure
