"""Judge sets that were kept and count: `python -m studies.verdicts FOLDER [--judge NAME ...] [--again]`.

Each set is judged once by each judge; several processes may share a folder.
"""

import argparse
import json
import os
import warnings
from pathlib import Path
from typing import Any

import pandas as pd
import torch

from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.settings.configuration import read_settings
from studies.verdicts.judges import JUDGES, judge_set
from studies.verdicts.sets import read_sets
from studies.verdicts.summary import tables

ROOT = Path(__file__).parents[2]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m studies.verdicts", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--judge", nargs="+", default=list(JUDGES), choices=list(JUDGES))
    parser.add_argument("--only", default="*", help="pattern of the sets' names")
    parser.add_argument("--again", action="store_true", help="forget earlier answers of these judges")
    given = parser.parse_args()
    torch.set_num_threads(1)
    warnings.filterwarnings("ignore")
    files = sorted(given.folder.glob(f"{given.only}.pkl"))
    base, effects = build_model("base", read_settings([ROOT / "config.yaml"]).physics_of("case1")), catalogue()
    if given.again:
        for path in files:
            for judge in given.judge:
                path.with_suffix(f".{judge}.json").unlink(missing_ok=True)
    rows: list[dict[str, Any]] = []
    for path in files:
        for judge in given.judge:
            kept = path.with_suffix(f".{judge}.json")
            try:
                os.close(os.open(kept, os.O_CREAT | os.O_EXCL))
            except FileExistsError:
                continue
            try:
                found = [judge_set(drawn, judge, drawn.fit(base), effects) for drawn in read_sets(path)]
            except BaseException:
                kept.unlink()
                raise
            kept.write_text(json.dumps(found))
            for row in found:
                print(
                    path.stem,
                    judge,
                    row["shows"] or "-",
                    "|",
                    row["named"] or row["verdict"],
                    "|",
                    row["grade"],
                    flush=True,
                )
    for path in files:
        for judge in given.judge:
            text = path.with_suffix(f".{judge}.json").read_text()
            rows += json.loads(text) if text else []
    print(*tables(pd.DataFrame(rows)), sep="\n\n")


if __name__ == "__main__":
    main()
