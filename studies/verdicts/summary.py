"""The rows counted: what answers are worth, by kind of arm, as tables and as a page."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from studies.shared import GRADES, markdown
from studies.verdicts.worlds import WORLDS

UNLIKELY = 0.05  # p-value
EDGES = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0001)  # of probabilities; names are given in the last interval

HOW = """
Of each arm there are five trials, four of which are fitted. An effect **shows** where nine of ten such recordings would
show it to one who knows what was hidden and how the noise is correlated. **Right**: all that shows is named, or nothing
shows and nothing is said to be missing. **Class**: it is in a class of at most three. **Left open**: it is not named,
and that something is (or may be) missing is said; or its class is larger. **Missed**: it shows, and nothing says so.
**Wrong**: a name or a class of which nothing is true of the arm, or "something is missing" where nothing is. "Something
like it" is true only where an effect outside the catalogue shows; noise of the EMG only where the recorder had it."""


def write_page(rows: pd.DataFrame, before: pd.DataFrame, date: str, commit: str) -> str:
    """The page of the study in Markdown.

    Args:
        rows: of `judge.judge_set`, of one judge.
        before: the same of earlier draws, by earlier searches.
    """
    grades, wrong_names = rows["grade"].value_counts(), int(rows["wrong_name"].sum())
    right, some, left, silent, wrong = (grades.get(grade, 0) for grade in GRADES)
    by_name = f" ({wrong_names} by a wrong name)" if wrong else ""
    head = (
        f"Of {len(rows)} simulated arms of {rows['world'].nunique()} kinds {right} were judged right, {some} in a "
        f"class, {left} were left open, {silent or 'none'} missed and {wrong or 'none'} wrong{by_name}, {date}, at "
        f"commit {commit}. All were drawn with a seed that nobody had looked at when the method was done. "
        "`python -m studies.verdicts FOLDER --draw SEED --page docs` makes such a page; [every set](study_cases.csv)."
    )
    parts = ["# How often the diagnosis is right", head, _all(pd.concat([before, rows]))]
    parts += ["![What names are worth.](study.png)", HOW.strip()]
    return "\n\n".join([*parts, *tables(rows)]) + "\n"


def _all(rows: pd.DataFrame) -> str:
    """What the answers of all draws are worth together."""
    wrong, visible, (true, names) = rows["grade"].eq("wrong"), answered_visible(rows), true_names(rows)
    return (
        f"**All {len(rows)} arms of all draws**, by this search and earlier ones, are the better guide, as draws "
        f"differ: wrong in {share(wrong.sum(), len(rows))}; visible effects named or in a class of at most three "
        f"in {share(visible.sum(), len(visible))}; names given at 95 % or more true in {share(true, names)}. "
        "[The earlier ones](study_before.csv)."
    )


def answered_visible(rows: pd.DataFrame) -> pd.Series:
    """Of the arms with a visible effect of the catalogue, which were judged right or in a class."""
    return rows[rows["shows"].ne("") & rows["taken_out"].eq("")]["grade"].isin(["right", "class"])


def true_names(rows: pd.DataFrame) -> tuple[int, int]:
    """Of the names given, how many are true, and how many there are."""
    return {low: (true, n) for low, _, n, true, _ in reliability(rows)}.get(EDGES[-2], (0, 0))


def tables(rows: pd.DataFrame) -> Iterator[str]:
    """The tables of the page in Markdown.

    Args:
        rows: of `judge.judge_set`, of one judge.
    """
    seen = rows["shows"].ne("").map({True: "an effect shows", False: "none shows"})
    worlds = pd.Categorical(rows["world"].map(WORLDS), WORLDS.values())
    grades = rows.groupby([worlds, seen], observed=True)["grade"]
    counts = [[*where, *_counted(of)] for where, of in grades] + [["all", "", *_counted(rows["grade"])]]
    yield markdown(["kind of arm", "", "arms", *GRADES.values()], counts)
    out, exact = rows[rows["taken_out"].ne("")], rows[~rows["recording"].str.contains("emg_noise")]
    clean = rows[rows["hidden"].eq("") & rows["world"].eq("as_assumed")]["nothing_missing"].dropna()
    shares = {
        "visible and named, or in a class of at most 3": answered_visible(rows),
        "a wrong name": rows["wrong_name"],
        "among effects not in the catalogue": out["wrong_name"],
        "EMG noise where there is none": exact["wrong_emg_noise"],
        f'"nothing is missing" has p below {UNLIKELY} on clean arms as assumed': clean < UNLIKELY,
    }
    lines = [[what, share(found.sum(), len(found))] for what, found in shares.items()]
    seconds = f"{rows['seconds'].mean():.0f}, {rows['seconds'].max():.0f}"
    yield markdown(["", "arms"], [*lines, ["seconds of an arm, mean and most", seconds]])
    held = rows.groupby(worlds, observed=True)[["held", "intervals"]].sum()
    yield markdown(
        ["95 % intervals that hold", ""], [[world, share(*of)] for world, of in held.iterrows() if of["intervals"]]
    )
    lines = [[f"{low:g} to {min(high, 1):g}", share(true, n)] for low, high, n, true, _ in reliability(rows)]
    yield markdown(["effects with a probability of", "true"], lines)


def _counted(grades: pd.Series) -> list[str]:
    """How many arms, and how many of each grade."""
    return [str(len(grades)), *(str(grades.eq(grade).sum()) for grade in GRADES)]


def reliability(rows: pd.DataFrame) -> list[tuple[float, float, int, int, float]]:
    """Of effects with a probability between two edges: the edges, how many, how many true, mean probability."""
    given = [
        (float(p), name in true.split())
        for probabilities, true in zip(rows["probabilities"], rows["true"], strict=True)
        for name, p in (entry.split("=") for entry in probabilities.split())
    ]
    bins = [(low, high, [(p, true) for p, true in given if low <= p < high]) for low, high in pairwise(EDGES)]
    return [
        (low, high, len(some), sum(true for _, true in some), float(np.mean([p for p, _ in some])))
        for low, high, some in bins
        if some
    ]


def share(count: int, of: int) -> str:
    """A count with the share and its 95 % interval in percent."""
    if not of:
        return ""
    low, high = binomtest(int(count), int(of)).proportion_ci(method="wilson")
    return f"{count} of {of}: {100 * count / of:.0f} ({100 * low:.0f} to {100 * high:.0f}) %"
