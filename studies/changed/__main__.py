"""Ask what changed where it is known, of a person and of simulated arms (a quarter of an hour on two cores).

    python -m studies.changed results --seed SEED --page docs

needs the main job's `results/data/human_curls/trials.parquet`, and writes docs/changed_cases.csv, from which
`python -m docs.measured` fills docs/changed.md. A seed whose answers have been looked at is spent.
"""

import argparse
from pathlib import Path

import pandas as pd
from joblib import Parallel, delayed, parallel_config

from myowave.data.store import read_trials
from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.settings.configuration import read_settings
from studies.changed.answers import answer, table
from studies.changed.questions import PERSON, of_arms, of_person

ROOT = Path(__file__).parents[2]
DATASETS = {PERSON: "human_curls", "arm": "case1"}  # whose physics they have


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m studies.changed", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("results", type=Path)
    parser.add_argument("--seed", type=int, required=True, help="first of the seeds of simulated arms")
    parser.add_argument("--draws", type=int, default=4, help="of each arm and change (4)")
    parser.add_argument("--page", type=Path, metavar="FOLDER", help="write the table there")
    given = parser.parse_args()
    trials = given.results / f"data/{DATASETS[PERSON]}/trials.parquet"
    if not trials.exists():
        parser.error(f"{trials} is not there; `snakemake {trials}` makes it.")
    settings, person = read_settings([ROOT / "config.yaml"]), read_trials(trials)
    bases = {of: build_model("base", settings.physics_of(name)) for of, name in DATASETS.items()}
    questions, effects = [*of_person(), *of_arms(given.seed, given.draws)], list(catalogue().values())
    with parallel_config("loky", inner_max_num_threads=1):
        asked = (delayed(answer)(q, person, bases, effects, settings.diagnosis.scatter) for q in questions)
        rows = pd.DataFrame(Parallel(-1, verbose=1)(asked))
    for part in (rows["of"].eq(PERSON), rows["of"].ne(PERSON)):
        print(*(table(rows[part], by) for by in ("done", "of")), sep="\n\n", end="\n\n")
    if given.page is not None:
        rows.to_csv(given.page / "changed_cases.csv", index=False, float_format="%.4g")


if __name__ == "__main__":
    main()
