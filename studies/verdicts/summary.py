"""The rows counted: what answers are worth, world by world and judge by judge, as tables and as a page."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import binomtest

GRADES = ("right", "class", "honest", "silent", "wrong")
NAMES = {
    "as_assumed": "as the model assumes",
    "other_curves": "other muscle curves",
    "other_constants": "other constants",
    "other_sensors": "other sensors and filters",
    "other_solver": "sample-and-hold of EMG in the solver",
    "outside": "effect not in the catalogue",
    "all_at_once": "all of these at once",
    "other_simulator": "another simulator",
}
KINDS = {True: "an effect shows", False: "none shows"}
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


def read_rows(path: str | Path) -> pd.DataFrame:
    """A table of `judges.judge_set`."""
    return pd.read_csv(path, keep_default_na=False, na_values={"nothing_missing": [""]})


def write_page(rows: pd.DataFrame, date: str, commit: str) -> str:
    """The page of the study in Markdown."""
    judges = list(dict.fromkeys(rows["judge"]))
    head = (
        f"{len(rows) // len(judges)} simulated arms in {rows['world'].nunique()} worlds, {date}, judged at commit "
        f"{commit}. All were drawn with seeds that nobody had looked at when the method was done. `rules` is the judge "
        "of before, on the same sets. `snakemake -s studies/verdicts/Snakefile --cores 2` makes them anew; [every "
        "set](study_cases.csv)."
    )
    parts = ["# How often the diagnosis is right", head, "![What names are worth.](study.png)", HOW.strip()]
    parts += tables(rows)
    return "\n\n".join(parts) + "\n"


def tables(rows: pd.DataFrame) -> Iterator[str]:
    """The tables of the page in Markdown."""
    rows = rows.assign(seen=rows["shows"].ne(""))
    judges = list(dict.fromkeys(rows["judge"]))
    heads = ["world", "", "sets", *(f"{judge}: {' / '.join(GRADES)}" for judge in judges)]
    lines = []
    for (world, seen), some in _ordered(rows):
        counts = [_counts(some[some["judge"] == judge]) for judge in judges]
        lines.append([NAMES[world], KINDS[seen], str(len(some) // len(judges)), *counts])
    lines.append(["all", "", str(len(rows) // len(judges)), *(_counts(rows[rows["judge"] == j]) for j in judges)])
    yield markdown(heads, lines)
    heads = [
        "judge",
        "visible and named, or in a class of at most 3",
        "a wrong name",
        "among effects not in the catalogue",
    ]
    heads += ["EMG noise where there is none", "seconds of a set, mean and most"]
    yield markdown(heads, [_rates(judge, rows[rows["judge"] == judge]) for judge in judges])
    lines = []
    for world, some in rows.groupby("world", sort=False):
        if some["intervals"].sum():
            cells = [_share(s["held"].sum(), s["intervals"].sum()) for s in (some[some["judge"] == j] for j in judges)]
            lines.append([NAMES[str(world)], *cells])
    yield markdown(["95 % intervals that hold", *judges], lines)
    clean = rows[rows["hidden"].eq("") & rows["world"].eq("as_assumed")]
    for judge in judges:
        p = clean[clean["judge"] == judge]["nothing_missing"].dropna()
        if len(p):
            low = _share(int((p < UNLIKELY).sum()), len(p))
            yield f'{judge}, "nothing is missing" on clean arms as assumed: p below {UNLIKELY} in {low}.'
        found = reliability(rows[rows["judge"] == judge].to_dict("records"))
        lines = [[f"{low:g} to {min(high, 1):g}", _share(true, n)] for low, high, n, true, _ in found if n]
        yield markdown([f"{judge}: names given at", "true"], lines)


def reliability(rows: Sequence[Mapping[str, Any]]) -> list[tuple[float, float, int, int, float]]:
    """Of names given at a probability between two edges: the edges, how many, how many true, mean probability."""
    given = [
        (float(p), name in row["true"].split())
        for row in rows
        for name, p in (entry.split("=") for entry in row["probabilities"].split())
    ]
    found = []
    for low, high in zip(EDGES, EDGES[1:], strict=False):
        some = [(p, true) for p, true in given if low <= p < high]
        mean = float(np.mean([p for p, _ in some])) if some else np.nan
        found.append((low, high, len(some), sum(true for _, true in some), mean))
    return found


def _ordered(rows: pd.DataFrame) -> Iterator[tuple[tuple[str, bool], pd.DataFrame]]:
    for world in NAMES:
        for seen in KINDS:
            some = rows[rows["world"].eq(world) & rows["seen"].eq(seen)]
            if len(some):
                yield (world, seen), some


def _counts(rows: pd.DataFrame) -> str:
    return " / ".join(str(int(rows["grade"].eq(grade).sum())) for grade in GRADES)


def _rates(judge: str, rows: pd.DataFrame) -> list[str]:
    seen = rows[rows["seen"] & rows["taken_out"].eq("")]
    out, exact = rows[rows["taken_out"].ne("")], rows[~rows["recording"].str.contains("emg_noise")]
    answered = seen["grade"].isin(["right", "class"])
    return [
        judge,
        _share(answered.sum(), len(seen)),
        _share(rows["wrong_name"].sum(), len(rows)),
        _share(out["wrong_name"].sum(), len(out)),
        _share(exact["wrong_emg_noise"].sum(), len(exact)),
        f"{rows['seconds'].mean():.0f}, {rows['seconds'].max():.0f}",
    ]


def _share(count: int, of: int) -> str:
    """A count with the share and its 95 % interval in percent."""
    if not of:
        return ""
    low, high = binomtest(int(count), int(of)).proportion_ci(method="wilson")
    return f"{count} of {of}: {100 * count / of:.0f} ({100 * low:.0f} to {100 * high:.0f}) %"


def markdown(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table."""
    return "\n".join("| " + " | ".join(cells) + " |" for cells in [heads, ["---"] * len(heads), *rows])
