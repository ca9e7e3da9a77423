"""A worker with a cheap objective, a process of its own: python sweep_worker.py JOURNAL TRIALS WORKER [PAUSE_S]."""

import math
import os
import subprocess
import sys
import time

import pandas as pd

from myowave.learning.sweep.search import open_search, tabulate, work
from myowave.settings import Sweep

SWEEP = {
    "dataset": "case1",
    "recipe": "rollout",
    "workers": 3,
    "dimensions": {"beta": {"low": 1e-5, "high": 1e-1, "log": True}, "hidden": {"low": 16, "high": 64}},
}
FIRST = {"beta": 1e-1, "hidden": 16}


def error_of(settings):
    """Smallest, 0, at beta 1e-3 and 40 hidden units."""
    return (math.log10(settings["beta"]) + 3) ** 2 + ((settings["hidden"] - 40) / 24) ** 2


def objective(settings, pause_s=0.0):
    for left in (1, 0):
        time.sleep(pause_s)
        yield left, (error_of(settings) + left, error_of(settings) + left)


def start(journal: str, trials: int, worker: int, pause_s: float = 0.0) -> subprocess.Popen:
    """A worker that goes on until there are so many trials; it prints the number of each that it finished."""
    command = [sys.executable, __file__, journal, str(trials), str(worker), str(pause_s)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ | {"OMP_NUM_THREADS": "1"})


def table_of(journal: str) -> pd.DataFrame:
    return tabulate(open_search("test", journal), Sweep(**SWEEP), FIRST)


if __name__ == "__main__":
    journal, trials, worker = sys.argv[1:4]
    sweep = Sweep(**SWEEP, trials=int(trials))
    search = open_search("test", journal, seed=int(worker))
    pause_s = float(sys.argv[4]) if len(sys.argv) > 4 else 0.0
    for trial in work(search, sweep, lambda settings: objective(settings, pause_s), int(worker)):
        print(trial.number, flush=True)
