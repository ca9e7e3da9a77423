"""A search for better settings that several workers share, by Optuna.

Workers are independent processes, on one machine or on many that share a file system, and meet in a journal file.
Whatever is killed, the search stays whole: a trial has the number of its worker, and a worker that starts again marks
what it was killed in as failed and tries it anew. So it does for workers that are no more, where there are fewer now.
Of the others nobody else can know that such a trial is dead.

What is judged is a generator that yields after each recording that was held out, and knows nothing of storage.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
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


Judgement = tuple[int, Sequence[float]]
"""How often a setting will be judged after this, 0 is the last; and by how much it misses the trials that were held out
so far, running free, for each seed [deg]."""
Objective = Callable[[Settings], Iterator[Judgement]]


def open_search(name: str, journal: str | Path, seed: int = 0) -> optuna.Study:
    """The search of this name in a journal file, made where it is not there yet; each worker with another seed."""
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
    """Let the settings that are to be improved be the first trial, where they are inside the ranges; before the workers
    start, as only one process may do so."""
    if _inside(settings, sweep):
        search.enqueue_trial({name: settings[name] for name in sweep.dimensions}, skip_if_exists=True)


def count(search: optuna.Study) -> int:
    """Number of trials that were or are being tried; one without a worker was cut off before it began."""
    return sum("worker" in trial.user_attrs for trial in search.get_trials(deepcopy=False, states=COUNTED))


def work(search: optuna.Study, sweep: Sweep, objective: Objective, worker: int) -> Iterator[FrozenTrial]:
    """Try settings until the search has as many trials as asked for, a few more where workers begin one in the same
    moment; yield each that this worker finished. No two that run may have the same number, a restarted one its own."""
    release(search, sweep, worker)
    while count(search) < sweep.trials:
        trial = search.ask()
        trial.set_user_attr("worker", worker)
        settings = {name: _suggest(trial, name, dimension) for name, dimension in sweep.dimensions.items()}
        if not _inside(settings, sweep):  # cut off before a range was narrowed
            search.tell(trial, state=TrialState.FAIL)
            continue
        try:
            error = _judge(trial, objective(settings))
        except BaseException:
            search.tell(trial, state=TrialState.FAIL)
            search.enqueue_trial(settings)
            raise
        yield search.tell(trial, error, state=TrialState.PRUNED if error is None else TrialState.COMPLETE)


def release(search: optuna.Study, sweep: Sweep, worker: int) -> None:
    """Mark trials that this worker was killed in, or one of its workers that are no more, as failed; the next ones try
    their settings anew."""
    for trial in search.get_trials(deepcopy=False, states=(TrialState.RUNNING,)):
        if trial.user_attrs.get("worker", math.nan) % sweep.workers == worker:  # NaN is nobody's
            search.tell(trial.number, state=TrialState.FAIL)
            search.enqueue_trial(trial.params)


def describe(trial: FrozenTrial) -> str:
    """A finished trial in a few words."""
    settings = ", ".join(f"{name} {value:.4g}" for name, value in trial.params.items())
    outcome = f"error {trial.value:.4g} deg" if trial.state is TrialState.COMPLETE else "given up"
    return f"trial {trial.number} ({settings}): {outcome}"


def tabulate(search: optuna.Study, sweep: Sweep, default: Settings) -> pd.DataFrame:
    """One row per trial: `after_{n}` are means over seeds and the first n trials that were held out, `seed_{i}` those
    of each seed over all of them."""
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
    """Settings of the best trial, by the error on held-out training trials, or a ValueError if none was tried to the
    end."""
    if not search.get_trials(deepcopy=False, states=(TrialState.COMPLETE,)):
        raise ValueError(
            f"sweep {search.study_name!r}: no setting was tried to the end without diverging; look into the logs of "
            "its workers, and narrow learning.sweep.dimensions."
        )
    return dict(search.best_params)


def _inside(settings: Settings, sweep: Sweep) -> bool:
    return all(d.low <= settings[name] <= d.high for name, d in sweep.dimensions.items())


def _judge(trial: Trial, judgements: Iterator[Judgement]) -> float | None:
    """Follow a trial through its judgements to its error; None where it is given up: it has diverged, or is worse than
    the median of those before."""
    for step, (left, errors) in enumerate(judgements):
        error = sum(errors) / len(errors)
        if not math.isfinite(error):
            return None
        trial.set_user_attr("errors", list(errors))
        trial.report(error, step)
        if left == 0:
            return error
        if trial.should_prune():
            return None
    raise AssertionError("the objective ended before its last judgement")


def _suggest(trial: Trial, name: str, dimension: Dimension) -> float:
    if SEARCHABLE[name] is int:
        return trial.suggest_int(name, int(dimension.low), int(dimension.high), log=dimension.log)
    return trial.suggest_float(name, dimension.low, dimension.high, log=dimension.log)
