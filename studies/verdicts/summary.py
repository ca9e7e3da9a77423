"""The rows counted: what answers are worth, world by world, as tables and as a page."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from studies.shared import markdown
from studies.verdicts.worlds import WORLDS

GRADES = ("right", "class", "honest", "silent", "wrong")
UNLIKELY = 0.05  # p-value
EDGES = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0001)  # of probabilities

HOW = """
A set is five trials of one simulated arm, four of which are fitted; each is judged as a recording of its own. An
effect **shows** where nine of ten such recordings would show it to one who knows what was hidden and how the noise is
correlated. **Right**: all that shows is named, or nothing shows and nothing is said to be missing. **Class**: it is in
a class of at most three. **Honest**: it is not named, and that something is (or may be) missing is said; or its class
is larger. **Silent**: it shows, and nothing says so. **Wrong**: a name or a class of which nothing is true of the arm,
or "something is missing" where nothing is. "Something like it" is true only where an effect outside the catalogue
shows; noise of the EMG only where the recorder had it."""


def write_page(rows: pd.DataFrame, date: str, commit: str) -> str:
    """The page of the study in Markdown."""
    grades, wrong_names = rows["grade"].value_counts(), int(rows["wrong_name"].sum())
    right, some, left, silent, wrong = (grades.get(grade, 0) for grade in GRADES)
    by_name = f" ({wrong_names} by a wrong name)" if wrong else ""
    head = (
        f"{right} verdicts were right, {some} named a class, {left} left it open, {silent or 'none'} were silent and "
        f"{wrong or 'none'} wrong{by_name}, on {len(rows)} simulated arms in {rows['world'].nunique()} worlds, "
        f"{date}, judged at commit {commit}. All were drawn with seeds that nobody had looked at when the method was "
        "done. "
        "`python -m studies.verdicts FOLDER --draw SEED --page docs` makes such a page; [every set](study_cases.csv)."
    )
    parts = ["# How often the diagnosis is right", head, "![What names are worth.](study.png)", HOW.strip()]
    return "\n\n".join([*parts, *tables(rows)]) + "\n"


def tables(rows: pd.DataFrame) -> Iterator[str]:
    """The tables of the page in Markdown.

    Args:
        rows: of `judge.judge_set`, of one judge.
    """
    seen = rows["shows"].ne("").map({True: "an effect shows", False: "none shows"})
    worlds = pd.Categorical(rows["world"].map(WORLDS), WORLDS.values())
    grades = rows.groupby([worlds, seen], observed=True)["grade"]
    counts = [[*where, *_counted(of)] for where, of in grades] + [["all", "", *_counted(rows["grade"])]]
    yield markdown(["world", "", "sets", *GRADES], counts)
    visible = rows[rows["shows"].ne("") & rows["taken_out"].eq("")]
    out, exact = rows[rows["taken_out"].ne("")], rows[~rows["recording"].str.contains("emg_noise")]
    clean = rows[rows["hidden"].eq("") & rows["world"].eq("as_assumed")]["nothing_missing"].dropna()
    shares = {
        "visible and named, or in a class of at most 3": visible["grade"].isin(["right", "class"]),
        "a wrong name": rows["wrong_name"],
        "among effects not in the catalogue": out["wrong_name"],
        "EMG noise where there is none": exact["wrong_emg_noise"],
        f'"nothing is missing" has p below {UNLIKELY} on clean arms as assumed': clean < UNLIKELY,
    }
    lines = [[what, share(found.sum(), len(found))] for what, found in shares.items()]
    seconds = f"{rows['seconds'].mean():.0f}, {rows['seconds'].max():.0f}"
    yield markdown(["", "sets"], [*lines, ["seconds of a set, mean and most", seconds]])
    held = rows.groupby(worlds, observed=True)[["held", "intervals"]].sum()
    yield markdown(
        ["95 % intervals that hold", ""], [[world, share(*of)] for world, of in held.iterrows() if of["intervals"]]
    )
    lines = [[f"{low:g} to {min(high, 1):g}", share(true, n)] for low, high, n, true, _ in reliability(rows)]
    yield markdown(["names given at", "true"], lines)


def _counted(grades: pd.Series) -> list[str]:
    """How many sets, and how many of each grade."""
    return [str(len(grades)), *(str(grades.eq(grade).sum()) for grade in GRADES)]


def reliability(rows: pd.DataFrame) -> list[tuple[float, float, int, int, float]]:
    """Of names given at a probability between two edges: the edges, how many, how many true, mean probability."""
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
