"""Judge the diagnosis as it is: on simulated sets in a folder, of which each is judged once.

    python -m studies.verdicts FOLDER --draw SEED       draw the sets of a seed that the folder lacks, judge, count
    python -m studies.verdicts FOLDER --judge NAME      keep answers under a name, beside those of other code
    python -m studies.verdicts FOLDER --page docs       write the page, its picture and the tables of all sets, too

Several processes may share a folder. A seed whose answers have been looked at is spent: it serves development, and the
page is made with one that nobody has seen.
"""

import argparse
import json
import os
import subprocess
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import date
from fnmatch import fnmatch
from importlib.util import find_spec
from pathlib import Path

import pandas as pd
import torch

from myowave.data.json_files import read_json
from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.plotting import save
from myowave.settings import SimulatedDataset
from myowave.settings.configuration import read_settings
from studies.verdicts.cases import list_cases
from studies.verdicts.figures import draw_reliability
from studies.verdicts.judge import judge_set
from studies.verdicts.sets import draw_set, read_set, write_set
from studies.verdicts.summary import tables, write_page

ROOT = Path(__file__).parents[2]
DATASET = "case1"
BY_HAND = "\n## Where it is wrong\n"  # from here on the page is written by hand, and stays


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m studies.verdicts", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--draw", type=int, metavar="SEED", help="draw the sets of this seed first")
    parser.add_argument("--judge", default="evidence", metavar="NAME", help="keep answers under this name")
    parser.add_argument("--only", default="*", metavar="PATTERN", help="sets whose names are like this")
    parser.add_argument("--again", action="store_true", help="forget earlier answers under this name")
    parser.add_argument("--page", type=Path, metavar="FOLDER", help="write the page there")
    given = parser.parse_args()
    torch.set_num_threads(1)
    warnings.filterwarnings("ignore")
    settings = read_settings([ROOT / "config.yaml"])
    dataset = settings.data.datasets[DATASET]
    assert isinstance(dataset, SimulatedDataset)
    base, effects = build_model("base", settings.physics_of(DATASET)), catalogue()
    given.folder.mkdir(parents=True, exist_ok=True)
    cases = [] if given.draw is None else list(list_cases(base, effects, given.draw))
    wanted = [case for case in cases if fnmatch(case.name, given.only)]
    if any(case.world == "mujoco" for case in wanted) and find_spec("mujoco") is None:
        parser.error("MuJoCo moves some of the arms: pip install --no-deps -r studies/verdicts/requirements.txt")
    for case in wanted:
        path = given.folder / f"{case.name}.pkl"
        with taken(path) as ours:
            if ours:
                write_set(draw_set(case, dataset, settings.diagnosis, base, effects), path)
    for path in sorted(given.folder.glob(f"{given.only}.pkl")):
        answer = path.with_suffix(f".{given.judge}.json")
        if given.again:
            answer.unlink(missing_ok=True)
        with taken(answer) as ours:
            if ours and path.stat().st_size and (drawn := read_set(path)):
                row = judge_set(drawn, given.judge, drawn.fit(base), effects)
                answer.write_text(json.dumps(row))
                found = row["shows"] or "-", row["named"] or row["verdict"], row["grade"]
                print(path.stem, *found, sep=" | ", flush=True)
    answers = sorted(given.folder.glob(f"{given.only}.{given.judge}.json"))
    rows = pd.DataFrame([read_json(path) for path in answers if path.stat().st_size])
    if rows.empty:
        parser.error(f"{given.folder} has no sets like {given.only}; --draw SEED draws some.")
    print(*tables(rows), sep="\n\n")
    if given.page is not None:
        ask = ["git", "rev-parse", "--short", "HEAD"]
        commit = subprocess.run(ask, capture_output=True, text=True, check=False).stdout.strip() or "unknown"
        page, cases, earlier = (given.page / name for name in ("study.md", "study_cases.csv", "study_before.csv"))
        before = [pd.read_csv(path, keep_default_na=False) for path in (earlier, cases) if path.exists()]
        others = pd.concat([rows[:0], *before])
        others = others[~others["draw"].isin(rows["draw"])]
        _, by_hand, text = page.read_text(encoding="utf-8").partition(BY_HAND) if page.exists() else ("", "", "")
        written = write_page(rows, others, f"{date.today():%-d %B %Y}", commit)
        page.write_text(f"{written}{by_hand}{text}", encoding="utf-8")
        rows.to_csv(cases, index=False)
        others.to_csv(earlier, index=False)
        save(draw_reliability(rows), given.page / "study.png")


@contextmanager
def taken(path: Path) -> Iterator[bool]:
    """Whether a file is ours to write: it was not there, and other processes leave it to us. Empty, it goes again."""
    try:
        os.close(os.open(path, os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        yield False
        return
    try:
        yield True
    finally:
        if not path.stat().st_size:
            path.unlink()


if __name__ == "__main__":
    main()
