"""A search shared by several workers: counts, kills, going on, pruning. The objective is a cheap formula."""

import math
import os
import signal

import pytest
from sweep_worker import FIRST, SWEEP, error_of, objective, start, table_of

from myowave.learning.sweep.search import Score, best_settings, importances, open_search, tabulate, work
from myowave.settings import Sweep


@pytest.fixture
def storage(tmp_path) -> str:
    path = str(tmp_path / "sweep" / "journal.log")
    open_search("test", path, Sweep(**SWEEP), FIRST)
    return path


def test_workers_share_a_journal_and_try_no_more_settings_than_asked_for(storage):
    workers = [start(storage, 13, i) for i in range(3)]
    printed = [worker.communicate(timeout=60)[0].split() for worker in workers]
    assert [worker.returncode for worker in workers] == [0, 0, 0]
    table = table_of(storage, 13)
    assert len(table) == 13
    assert set(table["state"]) <= {"complete", "pruned"}
    assert sorted(int(n) for p in printed for n in p) == sorted(table["trial"])


def test_a_killed_trial_is_marked_and_the_search_goes_on_to_the_number(storage):
    worker = start(storage, 6, 0, pause_s=0.3)
    worker.stdout.readline()  # a trial is finished, the next one begins
    os.kill(worker.pid, signal.SIGKILL)
    worker.communicate(timeout=60)
    before = table_of(storage, 6)
    finished = before[before["state"] == "complete"]
    assert (before["state"] == "running").sum() <= 1 and 1 <= len(finished) < 6

    again = start(storage, 6, 0)
    again.communicate(timeout=60)
    after = table_of(storage, 6)
    assert "running" not in set(after["state"])
    assert after["state"].isin(["complete", "pruned"]).sum() == 6
    kept = after[after["trial"].isin(finished["trial"])]
    assert kept["error"].tolist() == finished["error"].tolist()


def run(storage: str, trials: int, judged=objective, **settings):
    search = open_search("test", storage, Sweep(**SWEEP | settings, trials=trials), FIRST, seed=1)
    return search, list(work(search, judged, "worker 0"))


def interrupted(settings):
    raise KeyboardInterrupt
    yield


def test_trials_of_another_worker_are_left_running(storage):
    other = open_search("test", storage, Sweep(**SWEEP, trials=4), FIRST)
    theirs = work(other, lambda settings: (run_meanwhile(), objective(settings))[1], "worker 1")
    mine = []

    def run_meanwhile():
        if not mine:
            mine.extend(run(storage, 4)[1])

    assert len(list(theirs)) == 1
    assert len(mine) == 3  # theirs counted as the fourth while it ran


def test_a_larger_number_later_continues(storage):
    _, first = run(storage, 4)
    search, more = run(storage, 7)
    assert len(first) == 4 and len(more) == 3
    assert len(search.trials()) == 7


def test_the_default_is_tried_first_and_again_if_it_was_interrupted(storage):
    with pytest.raises(KeyboardInterrupt):
        run(storage, 3, interrupted)
    search, trials = run(storage, 3)
    assert trials[0].params == FIRST
    table = tabulate(search)
    assert table.loc[table["is_default"], "state"].tolist() == ["fail", "complete"]


def test_a_default_outside_the_ranges_is_not_tried(storage):
    narrow = {"beta": {"low": 1e-4, "high": 1e-3}, "hidden": {"low": 16, "high": 64}}
    _, trials = run(storage, 2, dimensions=narrow)
    assert all(1e-4 <= trial.params["beta"] <= 1e-3 for trial in trials)


def test_the_search_finds_what_is_better(storage):
    search, _ = run(storage, 40)
    assert error_of(best_settings(search)) < 0.1 * error_of(FIRST)


def test_what_does_not_matter_has_no_importance(storage):
    search, _ = run(storage, 25, lambda settings: iter([Score(0, (error_of(settings | {"hidden": 40}),))]))
    shares = importances(search)
    assert math.isclose(sum(shares.values()), 1.0)
    assert shares["beta"] > 0.9


def test_hopeless_trials_stop_after_a_scale_and_diverged_ones_at_once(storage):
    reached = []

    def worse_each_time(settings):
        for level in (2, 1, 0):
            reached.append(level)
            error = float(len(reached)) if len(reached) < 15 else math.nan
            yield Score(level, (error, error))

    search, trials = run(storage, 14, worse_each_time)
    assert [t.state.name for t in trials] == ["COMPLETE"] * 3 + ["PRUNED"] * 11
    assert reached == [2, 1, 0] * 3 + [2] * 11
    assert tabulate(search)["error"].notna().sum() == 3


def test_an_error_in_the_objective_ends_the_worker_and_is_not_counted(storage):
    def broken(settings):
        raise ZeroDivisionError
        yield

    with pytest.raises(ZeroDivisionError):
        run(storage, 2, broken)
    _, trials = run(storage, 2)
    assert len(trials) == 2


def test_a_search_without_a_result_says_where_to_look(storage):
    search, _ = run(storage, 2, lambda settings: iter([Score(1, (math.inf, 1.0))]))
    with pytest.raises(ValueError, match="learning.sweep.dimensions"):
        best_settings(search)
    assert importances(search) == {}


def test_an_unreachable_server_is_a_plain_message_without_the_password():
    with pytest.raises(ValueError, match="learning.sweep.storage") as error:
        open_search("test", "postgresql://me:secret@127.0.0.1:1/none", Sweep(**SWEEP), FIRST)
    assert "secret" not in str(error.value)
