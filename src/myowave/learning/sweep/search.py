"""A search for better settings that several workers share, by Optuna.

Workers are independent processes, on one machine or on many that share a file system, and meet in a journal file.
Whatever is killed, the search stays whole: a trial has the name of its worker, and a worker that starts again marks
what it was killed in as failed and tries it anew. Nobody else can know that such a trial is dead.

What is judged is a generator: it yields a score after each recording that was held out, and knows nothing of trials,
pruning or storage.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import optuna
import pandas as pd
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend, JournalFileSymlinkLock
from optuna.trial import FrozenTrial, Trial, TrialState

from myowave.settings import SEARCHABLE, Dimension, Sweep

optuna.logging.set_verbosity(optuna.logging.WARNING)  # the job's log says what happens

COUNTED = (TrialState.COMPLETE, TrialState.PRUNED, TrialState.RUNNING)  # what failed is tried anew
UNPRUNED = 5  # settings tried to the end before any is given up, and chosen at random
Settings = Mapping[str, float]


@dataclass(frozen=True)
class HeldOutError:
    """How far a setting misses held-out trials, as far as it has been tried.

    Args:
        left: how often it will be judged after this; 0 is the last.
        errors: free-running error on the held-out data, one per seed.
    """

    left: int
    errors: tuple[float, ...]

    @property
    def mean(self) -> float:
        return sum(self.errors) / len(self.errors)


Objective = Callable[[Settings], Iterator[HeldOutError]]


def open_search(name: str, journal: str | Path, seed: int = 0) -> optuna.Study:
    """The search of this name in a journal file, made where it is not there yet.

    Args:
        seed: another for each worker.
    """
    Path(journal).parent.mkdir(parents=True, exist_ok=True)
    # Appending takes milliseconds; a lock older than 10 s was left by a worker that was killed.
    backend = JournalFileBackend(str(journal), JournalFileSymlinkLock(str(journal), grace_period=10))
    return optuna.create_study(
        study_name=name,
        storage=JournalStorage(backend),
        sampler=optuna.samplers.TPESampler(seed=seed, n_startup_trials=UNPRUNED),
        pruner=optuna.pruners.MedianPruner(n_startup_trials=UNPRUNED),
        load_if_exists=True,
    )


def try_first(search: optuna.Study, settings: Settings, sweep: Sweep) -> None:
    """Let the settings that are to be improved be the first trial, where they are inside the ranges.

    Only one process may do so, so this is called before the workers start.
    """
    if all(d.low <= settings[name] <= d.high for name, d in sweep.dimensions.items()):
        search.enqueue_trial({name: settings[name] for name in sweep.dimensions}, skip_if_exists=True)


def count(search: optuna.Study) -> int:
    """Number of trials that were or are being tried; one without a worker was cut off before it began."""
    return sum("worker" in trial.user_attrs for trial in search.get_trials(deepcopy=False, states=COUNTED))


def work(search: optuna.Study, sweep: Sweep, objective: Objective, worker: str) -> Iterator[FrozenTrial]:
    """Try settings until the search has as many trials as asked for; yield each that this worker finished.

    Workers that begin a trial in the same moment may try a few more.

    Args:
        worker: name of this worker; no two that run may have the same, and a restarted one has the same again.
    """

    release(search, worker)
    finished: list[FrozenTrial] = []

    def judged(trial: Trial) -> float:
        trial.set_user_attr("worker", worker)
        settings = {name: _suggest(trial, name, dimension) for name, dimension in sweep.dimensions.items()}
        try:
            return _judge(trial, objective(settings))
        except optuna.TrialPruned:
            raise
        except BaseException:
            search.enqueue_trial(settings)
            raise

    while count(search) < sweep.trials:
        search.optimize(judged, n_trials=1, callbacks=[lambda _, trial: finished.append(trial)])
        yield finished.pop()


def release(search: optuna.Study, worker: str) -> None:
    """Mark trials that this worker was killed in as failed; the next ones try their settings anew."""
    for trial in search.get_trials(deepcopy=False, states=(TrialState.RUNNING,)):
        if trial.user_attrs.get("worker") == worker:
            search.tell(trial.number, state=TrialState.FAIL)
            search.enqueue_trial(trial.params)


def describe(trial: FrozenTrial) -> str:
    """A finished trial in a few words."""
    settings = ", ".join(f"{name} {value:.4g}" for name, value in trial.params.items())
    outcome = f"error {trial.value:.4g} deg" if trial.state is TrialState.COMPLETE else "given up"
    return f"trial {trial.number} ({settings}): {outcome}"


def tabulate(search: optuna.Study, sweep: Sweep, default: Settings) -> pd.DataFrame:
    """One row per trial: number, state, error, settings, error at each judgement and of each seed, duration, worker.

    Columns `after_{n}` are means over seeds and the first n trials that were held out, `seed_{i}` those of the last.
    """
    rows = []
    for trial in search.get_trials(deepcopy=False):
        if not trial.params:  # not begun
            continue
        rows.append(
            {
                "trial": trial.number,
                "state": trial.state.name.lower(),
                "error": trial.value if trial.state is TrialState.COMPLETE else math.nan,
                **{name: trial.params.get(name, math.nan) for name in sweep.dimensions},
                **{f"after_{step + 1}": error for step, error in sorted(trial.intermediate_values.items())},
                **{f"seed_{i}": error for i, error in enumerate(trial.user_attrs.get("errors", []))},
                "is_default": all(default[name] == value for name, value in trial.params.items()),
                "duration_s": trial.duration.total_seconds() if trial.duration else math.nan,
                "worker": trial.user_attrs.get("worker"),
            }
        )
    return pd.DataFrame(rows)


def best_settings(search: optuna.Study) -> dict[str, float]:
    """Settings of the best trial that was not given up, by the error on held-out training trials.

    Raises:
        ValueError: if none was tried to the end.
    """
    if not search.get_trials(deepcopy=False, states=(TrialState.COMPLETE,)):
        raise ValueError(
            f"sweep {search.study_name!r}: no setting was tried to the end without diverging; look into the logs of "
            "its workers, and narrow learning.sweep.dimensions."
        )
    return dict(search.best_params)


def _judge(trial: Trial, scores: Iterator[HeldOutError]) -> float:
    """Follow a trial through its judgements to its error."""
    for step, score in enumerate(scores):
        if not math.isfinite(score.mean):
            raise optuna.TrialPruned("diverged: as hopeless as can be")
        trial.set_user_attr("errors", list(score.errors))
        trial.report(score.mean, step)
        if score.left == 0:
            return score.mean
        if trial.should_prune():
            raise optuna.TrialPruned("worse than the median of those before")
    raise AssertionError("the objective ended before its last judgement")


def _suggest(trial: Trial, name: str, dimension: Dimension) -> float:
    if SEARCHABLE[name] is int:
        return trial.suggest_int(name, int(dimension.low), int(dimension.high), log=dimension.log)
    return trial.suggest_float(name, dimension.low, dimension.high, log=dimension.log)
