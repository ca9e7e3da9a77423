"""Networks with other trials held out in turn: whether it matters which trials test, and how many scales help."""

from collections.abc import Sequence
from dataclasses import replace

import pandas as pd

from myowave.data.trials import Trials

SEPARATOR = " and "  # between the names of trials that are held out together


def hold_out(trials: Trials, test: Sequence[str]) -> Trials:
    """The same trials with others that test.

    Raises:
        ValueError: for a trial that is not there, or where none is left to train on.
    """
    trials.index(test)
    if not set(trials.names) - set(test):
        raise ValueError(
            f"dataset {trials.dataset!r}: held_out.test names every trial ({', '.join(test)}); leave some to train on."
        )
    return replace(trials, test=tuple(test))


def tabulate_scales(scores: pd.DataFrame) -> pd.DataFrame:
    """Test R2 of every number of scales, over seeds and over which trials are held out.

    Args:
        scores: rows of evaluations with the further column held_out.

    Returns:
        One row per number of scales: mean; standard deviation over seeds (of one choice of trials, pooled) and over
        the choices of trials (of their means); lowest and highest network; and the mean of each choice of trials.
    """
    rows = []
    for scales, of_scales in scores.groupby("scales"):
        by_choice = of_scales.groupby("held_out", sort=False)["test_r2"]
        means = by_choice.mean()
        r2 = of_scales["test_r2"]
        rows.append(
            {
                "scales": scales,
                "networks": len(r2),
                "mean": r2.mean(),
                "sd_seeds": (by_choice.var(ddof=1).mean()) ** 0.5,
                "sd_trials": means.std(ddof=1),
                "lowest": r2.min(),
                "highest": r2.max(),
                **means,
            }
        )
    return pd.DataFrame(rows)


def write_page(table: pd.DataFrame, dataset: str, recipe: str, seconds: float) -> str:
    """The table as Markdown."""
    choices = list(table.columns[7:])
    head = ["scales", "mean", "SD of seeds", "SD of trials", "lowest", "highest", *choices]
    lines = [
        f"# {dataset}: test R² by number of scales and by which trials are held out",
        "",
        f"Recipe `{recipe}`, free running; {int(table['networks'].iloc[0])} networks for each number of scales. SD of "
        "seeds: among networks with the same trials held out; SD of trials: among the means of the choices of trials, "
        "which are the columns on the right. Written by `snakemake -s studies/held_out/Snakefile --cores 2`; training "
        f"took {seconds / 60:.0f} min of one core.",
        "",
        "| " + " | ".join(head) + " |",
        "|---" * len(head) + "|",
    ]
    for _, row in table.iterrows():
        numbers = [row[c] for c in ("mean", "sd_seeds", "sd_trials", "lowest", "highest", *choices)]
        lines.append(f"| {row['scales']:.0f} | " + " | ".join(f"{number:.3f}" for number in numbers) + " |")
    return "\n".join(lines) + "\n"
