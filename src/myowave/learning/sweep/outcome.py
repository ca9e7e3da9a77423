"""What a sweep leaves behind: the best settings as a file for a normal run, and their test score beside the default."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from myowave.learning.sweep.objective import with_settings
from myowave.learning.sweep.study import Settings
from myowave.settings import Recipe, Sweep, dump

BEST = "_best"  # the best settings of a recipe make a recipe of this ending


def study_name(sweep: Sweep, judged: Mapping[str, Any], data: Path) -> str:
    """A name that is the same only where errors of trials can be compared.

    Ranges, number of trials and how they are chosen may change between runs; what a trial is judged by may not.

    Args:
        judged: settings that the error depends on, and the digest of the code.
        data: held-out trials at all scales.
    """
    fixed = dump(sweep)
    for free in ("dimensions", "trials", "workers", "pruner", "unpruned", "seed", "storage"):
        fixed.pop(free)
    text = json.dumps([fixed, dict(judged)], sort_keys=True, default=str)
    digest = hashlib.sha256(text.encode() + data.read_bytes()).hexdigest()[:12]
    return f"{sweep.dataset} {sweep.model} {sweep.recipe} {sweep.scales}-scale {digest}"


def override_text(sweep: Sweep, recipe: Recipe, best: Settings, table: pd.DataFrame, path: str) -> str:
    """A configuration file, to lay over config.yaml, with the best settings as a recipe of their own.

    Args:
        table: of the trials, see `study.tabulate`.
        path: where the file will be, for its own comment.
    """
    done = table[table["state"] == "complete"]
    default = done.loc[done["is_default"], "error"]
    against = f", of the default {default.iloc[0]:.4g}" if len(default) else ""
    name = sweep.recipe + BEST
    values = {
        "targets": {"recipes": [sweep.recipe, name]},
        "learning": {"recipes": {name: dump(with_settings(recipe, best))}},
    }
    return (
        f"# Best of {table['state'].isin(['complete', 'pruned']).sum()} settings of recipe {sweep.recipe} on "
        f"{sweep.dataset}, {sweep.model}, {sweep.scales}-scale.\n"
        f"# Error on held-out data {done['error'].min():.4g} deg{against}.\n"
        f"# A normal run with it: snakemake --cores 2 --configfile config.yaml {path}\n"
        f"{yaml.safe_dump(values, sort_keys=False)}"
    )


def compare_scores(default: pd.DataFrame, best: pd.DataFrame) -> pd.DataFrame:
    """Test scores of both settings: a row a setting and seed, columns those of summary.csv after `setting`."""
    both = pd.concat({"default": default, "best": best}, names=["setting", None])
    return both.reset_index(level="setting").reset_index(drop=True)
