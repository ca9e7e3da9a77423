"""What a sweep leaves behind: a summary, the best settings as a file for a normal run, and their test scores."""

import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from myowave.learning.sweep.search import Settings
from myowave.settings import Dimension, Recipe, Sweep, dump

BEST = "_best"  # the best settings of a recipe make a recipe of this ending
_EDGE = 0.05  # share of a range that counts as its edge


def search_name(sweep: Sweep, judged: Mapping[str, Any], data: Path) -> str:
    """A name that is the same only where errors of trials can be compared: ends of ranges, number of trials and of
    workers may change between runs. Which settings are searched may not, nor what a trial is `judged` by: other
    settings, the digest of the code and, in the file `data`, training trials at all scales."""
    fixed = dump(sweep)
    for free in ("trials", "workers"):
        fixed.pop(free)
    fixed["dimensions"] = {name: dimension.log for name, dimension in sweep.dimensions.items()}
    text = json.dumps([fixed, dict(judged)], sort_keys=True, default=str)
    digest = hashlib.sha256(text.encode() + data.read_bytes()).hexdigest()[:12]
    return f"{sweep.dataset} {sweep.model} {sweep.recipe} {sweep.scales}-scale {digest}"


def override_text(sweep: Sweep, recipe: Recipe, best: Settings, table: pd.DataFrame, path: str) -> str:
    """A configuration file, to lay over config.yaml, with the best settings as a recipe of their own; of the table of
    `search.tabulate`, and with the path where it will be in its comment."""
    name = sweep.recipe + BEST
    figure = f"results/figures/{sweep.dataset}/{sweep.model}/{name}/metrics.png"
    values = {
        "targets": {"recipes": [sweep.recipe, name], "own_recipes": {sweep.dataset: [sweep.recipe, name]}},
        "learning": {"recipes": {name: dump(recipe.changed(best))}},
    }
    return (
        f"# Recipe {sweep.recipe} on {sweep.dataset}, {sweep.model}, {sweep.scales}-scale: {_finding(table)}\n"
        "# Train with it, files of your own named before it:\n"
        f"# snakemake --cores 2 --configfile config.yaml {path} -- {figure}\n"
        "# Without what follows -- for all that plain snakemake makes, with these settings beside the others.\n"
        f"{yaml.safe_dump(values, sort_keys=False)}"
    )


def edge_of(dimension: Dimension, value: float) -> str:
    """`low` or `high` where a value lies at that edge of its range, else nothing."""
    low, high = dimension.low, dimension.high
    if dimension.log:
        low, high, value = math.log(low), math.log(high), math.log(value)
    share = (value - low) / (high - low)
    return "low" if share <= _EDGE else "high" if share >= 1 - _EDGE else ""


def summary_text(sweep: Sweep, default: Settings, best: Settings, table: pd.DataFrame) -> str:
    """What the search found, in Markdown: best settings, those of the recipe that was to be improved, ranges, and where
    one was too narrow; from `search.tabulate`."""
    rows, advice = [], []
    for name, dimension in sweep.dimensions.items():
        edge = edge_of(dimension, best[name])
        ends = f"{dimension.low:g} to {dimension.high:g}"
        rows.append(f"| {name} | {best[name]:.4g} | {default[name]:.4g} | {ends} | {edge and f'{edge} edge'} |")
        if edge:
            where = f"learning.sweep.dimensions.{name}.{edge}"
            advice.append(
                f"**The best {name}, {best[name]:.4g}, lies at the {edge} edge of its range, {ends}: the least error "
                f"may be beyond it.** Widen `{where}`, raise `learning.sweep.trials`, and start the sweep again; it "
                "goes on from here.\n"
            )
    head = "| setting | best | default | range | best at |\n|---|---|---|---|---|"
    return "\n".join([_finding(table), "", head, *rows, "", *advice])


def _finding(table: pd.DataFrame) -> str:
    done = table[table["state"] == "complete"]
    default = done.loc[done["is_default"], "error"]
    least = done["error"].min()
    tried = table["state"].isin(["complete", "pruned"]).sum()
    found = f"Best of {tried} settings: error on held-out data {least:.4g} deg"
    if default.empty:
        return f"{found}."
    gained = 100 * (1 - least / default.iloc[0])
    return (
        f"{found}, of the default {default.iloc[0]:.4g} deg ({gained:.1f} % less, as the best of so many it flatters)."
    )
