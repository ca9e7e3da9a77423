"""A search for better settings that several workers share: the only module that imports Optuna.

A search lives in a storage that all workers see: a journal file, or a PostgreSQL server. Workers are independent
processes, on one machine or on many. Whatever is killed, the search stays whole:

- Each trial carries the name of its worker from its making on. A worker that starts first marks trials FAIL that it
  left unfinished when it was killed. Nobody else can know that they are dead: storages keep them RUNNING for ever.
- Trials are numbered one after the other by the storage, so each worker can see by itself whether its new trial still
  belongs to the number asked for. No lock is needed, and none is computed in excess.

What is judged is a generator: it yields a score after each scale or each recording that was held out, and knows nothing
of trials, pruning or storages.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import optuna
import pandas as pd
from optuna.distributions import FloatDistribution, IntDistribution
from optuna.storages import BaseStorage, JournalStorage, RDBStorage
from optuna.storages.journal import JournalFileBackend, JournalFileSymlinkLock
from optuna.trial import FrozenTrial, Trial, TrialState, create_trial

from myowave.settings import Recipe, Sweep
from myowave.settings.section import without_passwords

optuna.logging.set_verbosity(optuna.logging.WARNING)  # the job's log says what happens

COUNTED = (TrialState.COMPLETE, TrialState.PRUNED, TrialState.RUNNING)  # failed ones are tried anew
Settings = Mapping[str, float]


@dataclass(frozen=True)
class Score:
    """How good a setting is, as far as it has been tried.

    Args:
        left: how often it will be judged after this; 0 is the last.
        errors: free-running error on the held-out data, one per seed.
    """

    left: int
    errors: tuple[float, ...]

    @property
    def mean(self) -> float:
        return sum(self.errors) / len(self.errors)


Objective = Callable[[Settings], Iterator[Score]]


@dataclass(frozen=True)
class Search:
    """An open search: a study of Optuna.

    Args:
        sweep: what is searched, how often, and when a trial is given up.
        default: settings that are to be improved; tried first where they are inside the ranges.
    """

    study: optuna.Study
    storage: BaseStorage
    sweep: Sweep
    default: Settings

    def trials(self, *states: TrialState) -> list[FrozenTrial]:
        """Trials in one of these states, or all."""
        return self.study.get_trials(deepcopy=False, states=states or None)

    @property
    def counted(self) -> int:
        """Number of trials that were or are being tried."""
        return len(self.trials(*COUNTED))


def open_search(name: str, storage: str, sweep: Sweep, default: Settings, seed: int = 0) -> Search:
    """The search of this name, made where it is not there yet.

    Only one process may open a PostgreSQL database for the first time, so this is called once before the workers start.

    Args:
        name: tells studies in one storage apart.
        storage: path of a journal file, or address of a PostgreSQL database.
        seed: of the search; another for each worker.

    Raises:
        ValueError: if the server cannot be reached.
    """
    opened = _open_storage(storage)
    pruner = optuna.pruners.MedianPruner(n_startup_trials=sweep.unpruned) if sweep.pruner == "median" else None
    study = optuna.create_study(
        study_name=name,
        storage=opened,
        sampler=optuna.samplers.TPESampler(seed=seed, n_startup_trials=sweep.unpruned),
        pruner=pruner or optuna.pruners.NopPruner(),
        load_if_exists=True,
    )
    return Search(study, opened, sweep, {name: default[name] for name in sweep.dimensions})


def work(search: Search, objective: Objective, worker: str) -> Iterator[FrozenTrial]:
    """Try settings until the search has as many trials as asked for; yield each that this worker finished.

    Args:
        objective: yields a score after each scale or held-out trial.
        worker: name of this worker; no two that run may have the same, and a restarted one has the same again.

    Raises:
        ValueError: if there is nothing to search.
    """
    if not search.sweep.dimensions:
        raise ValueError("learning.sweep.dimensions is empty; name at least one setting and its range.")
    release(search, worker)
    while search.counted < search.sweep.trials:
        trial = _begin(search, worker)
        if trial is None:  # another worker was faster
            continue
        try:
            settings = {name: _suggest(trial, name, search.sweep) for name in search.sweep.dimensions}
            state, value = _judge(trial, objective(settings))
        except BaseException:
            search.study.tell(trial, state=TrialState.FAIL)
            raise
        yield search.study.tell(trial, value, state)


def release(search: Search, worker: str) -> list[int]:
    """Mark trials FAIL that this worker was killed in; return their numbers."""
    left = [t.number for t in search.trials(TrialState.RUNNING) if t.user_attrs["worker"] == worker]
    for number in left:
        search.study.tell(number, state=TrialState.FAIL)
    return left


def describe(trial: FrozenTrial) -> str:
    """A finished trial in a few words."""
    settings = ", ".join(f"{name} {value:.4g}" for name, value in trial.params.items())
    outcome = f"error {trial.value:.4g} deg" if trial.state is TrialState.COMPLETE else "given up"
    return f"trial {trial.number} ({settings}): {outcome}"


def tabulate(search: Search) -> pd.DataFrame:
    """One row per trial: number, state, error, settings, error at each judgement and of each seed, duration, worker.

    Columns `left_{n}` are means over seeds with n judgements to come, `seed_{i}` those of the last that was reached.
    Trials that were never begun, as the search was full or another worker had the default, are left out.
    """
    rows = []
    for trial in search.trials():
        if not trial.params or "refused" in trial.user_attrs:
            continue
        scores = {f"left_{left}": error for left, error in sorted(trial.user_attrs.get("judged", {}).items())}
        seeds = {f"seed_{i}": error for i, error in enumerate(trial.user_attrs.get("errors", []))}
        rows.append(
            {
                "trial": trial.number,
                "state": trial.state.name.lower(),
                "error": trial.value if trial.state is TrialState.COMPLETE else math.nan,
                **{name: trial.params.get(name, math.nan) for name in search.sweep.dimensions},
                **scores,
                **seeds,
                "is_default": _is_default(trial),
                "duration_s": trial.duration.total_seconds() if trial.duration else math.nan,
                "worker": trial.user_attrs["worker"],
            }
        )
    return pd.DataFrame(rows)


def best_settings(search: Search) -> dict[str, float]:
    """Settings of the best trial that was not given up.

    Raises:
        ValueError: if none was tried to the end.
    """
    if not search.trials(TrialState.COMPLETE):
        raise ValueError(
            f"sweep {search.study.study_name!r}: no setting was tried to the end without diverging; look into the "
            "logs of its workers, and narrow learning.sweep.dimensions."
        )
    return dict(search.study.best_params)


def importances(search: Search) -> dict[str, float]:
    """Share of the variance of the error that each setting explains, the largest first; sums to 1.

    Empty below 4 finished trials. By functional ANOVA of a forest (Hutter et al. 2014).
    """
    done = search.trials(TrialState.COMPLETE)
    if len(done) < 4 or len({trial.value for trial in done}) == 1:
        return {}
    evaluator = optuna.importance.FanovaImportanceEvaluator(seed=search.sweep.seed)
    names = list(search.sweep.dimensions)
    return optuna.importance.get_param_importances(search.study, evaluator=evaluator, params=names)


def _open_storage(storage: str) -> BaseStorage:
    if "://" not in storage:
        Path(storage).parent.mkdir(parents=True, exist_ok=True)
        # Appending takes milliseconds; a lock older than 10 s was left by a worker that was killed.
        return JournalStorage(JournalFileBackend(storage, JournalFileSymlinkLock(storage, grace_period=10)))
    try:
        return RDBStorage(storage, engine_kwargs={"pool_pre_ping": True})
    except Exception as error:  # whatever the driver raises: no server, no such database, wrong password
        raise ValueError(
            without_passwords(
                f"learning.sweep.storage = {storage}: the database cannot be opened ({type(error).__name__}: {error})."
            )
            + " Start the server and create the database, or use `storage: journal`."
        ) from None


def _begin(search: Search, worker: str) -> Trial | None:
    """A new trial with the worker's name on it, or None where it turns out to be one too many."""
    default = _inside(search.default, search.sweep) and not any(map(_is_default, search.trials(*COUNTED)))
    template = create_trial(
        state=TrialState.RUNNING,
        user_attrs={"worker": worker, "default": default},
        params=dict(search.default) if default else {},
        distributions={n: _distribution(n, search.sweep) for n in search.sweep.dimensions} if default else {},
    )
    study_id = search.storage.get_study_id_from_name(search.study.study_name)
    trial = Trial(search.study, search.storage.create_new_trial(study_id, template))
    before = [t for t in search.trials(*COUNTED) if t.number < trial.number]
    if len(before) >= search.sweep.trials or (default and any(map(_is_default, before))):
        trial.set_user_attr("refused", True)
        search.study.tell(trial, state=TrialState.FAIL)
        return None
    return trial


def _is_default(trial: FrozenTrial) -> bool:
    return bool(trial.user_attrs["default"])


def _judge(trial: Trial, scores: Iterator[Score]) -> tuple[TrialState, float | None]:
    """Follow a trial through its judgements; how it ended and its error, which only a complete one has."""
    judged: dict[str, float] = {}
    for step, score in enumerate(scores):
        if not math.isfinite(score.mean):  # diverged: as hopeless as can be
            return TrialState.PRUNED, None
        judged[str(score.left)] = score.mean
        trial.set_user_attr("judged", judged)
        trial.set_user_attr("errors", list(score.errors))
        if score.left == 0:
            return TrialState.COMPLETE, score.mean
        trial.report(score.mean, step)
        if trial.should_prune():
            return TrialState.PRUNED, None
    raise AssertionError("the objective ended before its last judgement")


def _suggest(trial: Trial, name: str, sweep: Sweep) -> float:
    d = _distribution(name, sweep)
    suggest = trial.suggest_int if isinstance(d, IntDistribution) else trial.suggest_float
    return suggest(name, d.low, d.high, log=d.log)


def _distribution(name: str, sweep: Sweep) -> IntDistribution | FloatDistribution:
    dimension = sweep.dimensions[name]
    if Recipe.model_fields[name].annotation is int:
        return IntDistribution(int(dimension.low), int(dimension.high), log=dimension.log)
    return FloatDistribution(dimension.low, dimension.high, log=dimension.log)


def _inside(settings: Settings, sweep: Sweep) -> bool:
    return all(d.low <= settings[name] <= d.high for name, d in sweep.dimensions.items())
