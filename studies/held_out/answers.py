"""What scales and physics buy, by question: paired differences with intervals, and the page."""

from collections.abc import Sequence
from datetime import date

import numpy as np
import pandas as pd
from scipy.stats import t as student

COLUMNS = ["question", "split", "method", "scales", "seed", "test_r2", "test_rmse_deg", "trial", "inputs"]
QUESTIONS = {
    "like_the_others": "a trial like the others",
    "unseen_load": "a load that was not trained",
    "few_trials": "few trials",
    "unseen_lean": "a lean that was not trained",
}
PLAIN, WEIGHED = "told", "weighed"
SEEN = {PLAIN: "load told", WEIGHED: "EMG over weight"}
DRAW = ["question", "split", "trial"]
LEVEL, SAME = 0.95, 1e-6


def means(scores: pd.DataFrame) -> pd.DataFrame:
    """Test R2 of each draw, a trial that tests in a split: mean over the seeds, by method, scales and inputs."""
    return scores.groupby([*DRAW, "method", "scales", "inputs"], sort=False)["test_r2"].mean().reset_index()


def differences(scores: pd.DataFrame, recipe: str) -> pd.DataFrame:
    """What each change does to the mean R2 of a draw, by question.

    Returns:
        Columns question, change, draws, gain, low, high: mean of the paired differences, and its 95 % interval (t, over
        draws); no interval of a single draw.
    """
    wide = means(scores).pivot(index=DRAW, columns=["method", "scales", "inputs"], values="test_r2")
    changes = {
        f"{scales} scales for 1, {SEEN[inputs]}": ((recipe, scales, inputs), (recipe, 1, inputs))
        for inputs in (PLAIN, WEIGHED)
        for scales in sorted(set(scores["scales"]) - {1})
    }
    rivals = [method for method in dict.fromkeys(scores["method"]) if method not in (recipe, "hold")]
    for method in [recipe, *rivals]:
        changes[f"EMG over weight, {method}"] = (method, 1, WEIGHED), (method, 1, PLAIN)
    for method in rivals:
        changes[f"{recipe} for {method}, {SEEN[PLAIN]}"] = (recipe, 1, PLAIN), (method, 1, PLAIN)
        changes[f"{recipe} for {method}, {SEEN[WEIGHED]}"] = (recipe, 1, WEIGHED), (method, 1, WEIGHED)
    rows = []
    for change, (after, before) in changes.items():
        if after not in wide or before not in wide:
            continue
        gains = (wide[after] - wide[before]).dropna()
        for question in (q for q in QUESTIONS if q in gains.index.get_level_values("question")):
            rows.append({"question": question, "change": change, **_interval(gains.loc[question].to_numpy())})
    return pd.DataFrame(rows)


def _interval(gains: np.ndarray) -> dict[str, float]:
    """Mean of draws, with the 95 % interval of the mean."""
    draws = len(gains)
    half = np.nan
    if draws > 1:
        half = student.ppf((1 + LEVEL) / 2, draws - 1) * gains.std(ddof=1) / np.sqrt(draws)
    return {"draws": draws, "gain": gains.mean(), "low": gains.mean() - half, "high": gains.mean() + half}


def best(scores: pd.DataFrame) -> pd.DataFrame:
    """The best of all methods, scales and inputs for each question, by the mean over draws."""
    of = means(scores).groupby(["question", "method", "scales", "inputs"], sort=False)["test_r2"].mean().reset_index()
    return of.loc[of.groupby("question", sort=False)["test_r2"].idxmax()].set_index("question")


def answer(scores: pd.DataFrame) -> str:
    """Who is best at what, in a sentence."""
    parts = [
        f"{QUESTIONS[str(question)]}: {label(row['method'], row['scales'], row['inputs'])} ({row['test_r2']:.3f})"
        for question, row in best(scores).iterrows()
    ]
    return "Best R²: " + "; ".join(parts) + "."


def bought(found: pd.DataFrame, recipe: str) -> list[str]:
    """What physics in the inputs and scales buy the network, a line for each."""
    said = {
        f"EMG over weight, {recipe}": "EMG over weight, with 1 scale",
        **{change: change for change in found["change"] if " scales for 1" in change},
    }
    lines = []
    for change, text in said.items():
        rows = found[found["change"] == change]
        parts = [f"{QUESTIONS[row['question']]} {_cell(row)}" for _, row in rows.iterrows()]
        lines.append(f"- {text[0].upper() + text[1:]}, changes R² by: {'; '.join(parts)}.")
    return lines


def label(method: str, scales: int, inputs: str) -> str:
    """A method in words."""
    return method + (f", {scales} scales" if scales > 1 else "") + (", EMG over weight" if inputs == WEIGHED else "")


def write_page(scores: pd.DataFrame, found: pd.DataFrame, recipe: str, today: date) -> str:
    """The page in Markdown."""
    seeds = scores["seed"].nunique()
    lines = [
        "# What scales and physics buy, by question",
        "",
        answer(scores),
        "",
        *bought(found, recipe),
        "",
        "![R² of every method, by question](held_out.png)",
        "",
        f"Written {today:%-d %B %Y} by `snakemake -s studies/held_out/Snakefile --cores 2`: trials of a person, "
        f"{len(scores[['question', 'split']].drop_duplicates())} splits, {seeds} seeds. A trial like the others; the "
        "other load; few training trials, of which the first and second have the test trial's load; the trial in which "
        "the upper arm leans most. *EMG over weight*: EMG counts over the torque that holds the level forearm with the "
        "load, and nothing else is told; else the load is told where it differs between training trials, and the two "
        "are the same where it does not. Scores are of each test trial by itself, running free; "
        "`results/held_out.csv` has a row for each of them and each seed.",
        "",
        *_table(scores, recipe),
        "",
        "Paired differences of R², mean and 95 % interval over test trials (t, seeds averaged); bold where the "
        "interval is on one side of 0. Few trials make wide intervals.",
        "",
        *_differences(found),
    ]
    return "\n".join(lines) + "\n"


def columns_of(scores: pd.DataFrame) -> list[tuple[str, str, pd.DataFrame]]:
    """Columns of table and picture: a heading, what it is over and the rows: few trials apart by their number."""
    made = []
    for question, rows in means(scores).groupby("question", sort=False):
        if question == "unseen_load":
            made += [(split, question, of) for split, of in rows.groupby("split", sort=False)]
        elif question == "few_trials":
            by = rows["split"].str.rsplit(n=1).str[0]
            made += [(name, question, of) for name, of in rows.groupby(by, sort=False)]
        else:
            made.append((str(question).replace("_", " "), question, rows))
    return made


def _table(scores: pd.DataFrame, recipe: str) -> list[str]:
    made = columns_of(scores)
    head = ["method", *(name for name, _, _ in made)]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    order = scores[["method", "scales", "inputs"]].drop_duplicates()
    order = order.sort_values(
        ["inputs", "method", "scales"], key=lambda c: c.map(_place(recipe)) if c.name == "method" else c
    )
    best_of = [rows.groupby(["method", "scales", "inputs"])["test_r2"].mean().max() for _, _, rows in made]
    for method, scales, inputs in order.itertuples(index=False):
        cells = []
        for (_, _, rows), top in zip(made, best_of, strict=True):
            r2 = rows.query("method == @method and scales == @scales and inputs == @inputs")["test_r2"].mean()
            cells.append(f"**{r2:.3f}**" if r2 == top else "" if np.isnan(r2) else f"{r2:.3f}")
        lines.append("| " + " | ".join([label(method, scales, inputs), *cells]) + " |")
    return lines


def _place(recipe: str) -> dict[str, int]:
    return {name: i for i, name in enumerate(["hold", "ridge", "trees", "gru_plain", "cnn", recipe])}


def _differences(found: pd.DataFrame) -> list[str]:
    questions: Sequence[str] = list(dict.fromkeys(found["question"]))
    lines = ["| change | " + " | ".join(QUESTIONS[q] for q in questions) + " |", "|---" * (len(questions) + 1) + "|"]
    for change, rows in found.groupby("change", sort=False):
        by = rows.set_index("question")
        cells = [_cell(by.loc[question]) if question in by.index else "" for question in questions]
        lines.append(f"| {change} | " + " | ".join(cells) + " |")
    return lines


def _cell(row: pd.Series) -> str:
    if abs(row["gain"]) < SAME:
        return "the same"
    text = f"{row['gain']:+.3f}"
    if np.isnan(row["low"]):
        return text
    clear = row["low"] > 0 or row["high"] < 0
    text += f" ({row['low']:+.3f} to {row['high']:+.3f})"
    return f"**{text}**" if clear else text
