"""A search shared by several workers: counts, kills, going on, pruning. The objective is a cheap formula."""

import math
import os
import signal

import pytest
from sweep_worker import FIRST, SWEEP, error_of, objective, start, table_of

from myowave.learning.sweep.figures import draw_search
from myowave.learning.sweep.search import best_settings, open_search, tabulate, try_first, work
from myowave.settings import Sweep


@pytest.fixture
def journal(tmp_path) -> str:
    path = str(tmp_path / "sweep" / "journal.log")
    try_first(open_search("test", path), FIRST, Sweep(**SWEEP))
    return path


def test_workers_share_a_journal_and_try_hardly_more_settings_than_asked_for(journal):
    workers = [start(journal, 13, i) for i in range(3)]
    printed = [worker.communicate(timeout=60)[0].split() for worker in workers]
    assert [worker.returncode for worker in workers] == [0, 0, 0]
    table = table_of(journal)
    assert 13 <= len(table) <= 15, "at most one more for each other worker"
    assert set(table["state"]) <= {"complete", "pruned"}
    assert sorted(int(n) for p in printed for n in p) == sorted(table["trial"])


def test_a_killed_trial_is_marked_and_tried_anew_and_the_search_goes_on_to_the_number(journal):
    worker = start(journal, 6, 0, pause_s=0.3)
    worker.stdout.readline()  # a trial is finished, the next one begins
    os.kill(worker.pid, signal.SIGKILL)
    worker.communicate(timeout=60)
    before = table_of(journal)
    finished, cut_off = (before[before["state"] == state] for state in ("complete", "running"))
    assert len(cut_off) <= 1 and 1 <= len(finished) < 6

    again = start(journal, 6, 0)
    again.communicate(timeout=60)
    after = table_of(journal)
    assert "running" not in set(after["state"])
    done = after[after["state"].isin(["complete", "pruned"])]
    assert len(done) == 6 and set(cut_off["beta"]) <= set(done["beta"])
    kept = after[after["trial"].isin(finished["trial"])]
    assert kept["error"].tolist() == finished["error"].tolist()


def run(journal: str, trials: int, judged=objective, **settings):
    search, sweep = open_search("test", journal, seed=1), Sweep(**SWEEP | settings, trials=trials)
    return search, list(work(search, sweep, judged, worker=0))


def interrupted(settings):
    raise KeyboardInterrupt
    yield


def test_trials_of_another_worker_are_left_running(journal):
    theirs = work(
        open_search("test", journal),
        Sweep(**SWEEP, trials=4),
        lambda settings: (run_meanwhile(), objective(settings))[1],
        worker=1,
    )
    mine = []

    def run_meanwhile():
        if not mine:
            mine.extend(run(journal, 4)[1])

    assert len(list(theirs)) == 1
    assert len(mine) == 3  # theirs counted as the fourth while it ran


@pytest.mark.parametrize("begun", [False, True])
def test_what_waits_outside_a_range_that_was_narrowed_is_not_tried_anew(journal, begun):
    """The default, before it was begun, and after it was interrupted."""
    if begun:
        with pytest.raises(KeyboardInterrupt):
            run(journal, 3, interrupted)
    narrow = SWEEP["dimensions"] | {"hidden": {"low": FIRST["hidden"] + 10, "high": 64}}
    with pytest.warns(UserWarning, match="Fixed parameter hidden with value 16 is out of range"):
        search, trials = run(journal, 3, dimensions=narrow)
    assert len(trials) == 3 and all(trial.params["hidden"] > FIRST["hidden"] for trial in trials)
    assert [t.state.name for t in search.trials if t.params["hidden"] == FIRST["hidden"]] == ["FAIL"] * (1 + begun)


def test_trials_of_workers_that_are_no_more_are_freed_each_by_one_that_is_left(journal):
    for worker in range(4):  # each is killed in a trial
        open_search("test", journal).ask().set_user_attr("worker", worker)
    open_search("test", journal).ask()  # of somebody who is about to begin it
    search, trials = run(journal, 4, workers=2)
    killed = ["FAIL", "RUNNING", "FAIL", "RUNNING", "RUNNING"]
    assert len(trials) == 2 and [t.state.name for t in search.trials[:5]] == killed
    assert len(list(work(search, Sweep(**SWEEP | {"workers": 2}, trials=4), objective, worker=1))) == 2
    assert [t.state.name for t in search.trials[:5]] == ["FAIL"] * 4 + ["RUNNING"]


def test_a_larger_number_later_continues(journal):
    _, first = run(journal, 4)
    search, more = run(journal, 7)
    assert len(first) == 4 and len(more) == 3
    assert len(search.trials) == 7


def test_the_default_is_tried_first_and_again_if_it_was_interrupted(journal):
    with pytest.raises(KeyboardInterrupt):
        run(journal, 3, interrupted)
    search, trials = run(journal, 3)
    assert trials[0].params == FIRST
    table = tabulate(search, Sweep(**SWEEP), FIRST)
    assert table.loc[table["is_default"], "state"].tolist() == ["fail", "complete"]


def test_a_default_outside_the_ranges_is_not_tried(tmp_path):
    narrow = Sweep(**SWEEP | {"dimensions": {"beta": {"low": 1e-4, "high": 1e-3}}})
    search = open_search("test", tmp_path / "journal.log")
    try_first(search, FIRST, narrow)
    assert not search.trials


def test_the_search_finds_what_is_better(journal):
    search, _ = run(journal, 40)
    assert error_of(best_settings(search)) < 0.1 * error_of(FIRST)


def test_hopeless_trials_stop_early_and_diverged_ones_at_once(journal):
    reached = []

    def worse_each_time(settings):
        for left in (2, 1, 0):
            reached.append(left)
            error = float(len(reached)) if len(reached) < 20 else math.nan
            yield left, (error, error)

    search, trials = run(journal, 14, worse_each_time)
    assert [t.state.name for t in trials] == ["COMPLETE"] * 5 + ["PRUNED"] * 9
    assert reached == [2, 1, 0] * 5 + [2] * 9
    assert tabulate(search, Sweep(**SWEEP), FIRST)["error"].notna().sum() == 5


def test_an_error_in_the_objective_ends_the_worker_and_is_not_counted(journal):
    def broken(settings):
        raise ZeroDivisionError
        yield

    with pytest.raises(ZeroDivisionError):
        run(journal, 2, broken)
    _, trials = run(journal, 2)
    assert len(trials) == 2


def test_a_search_without_a_result_says_where_to_look(journal):
    search, _ = run(journal, 2, lambda settings: iter([(1, (math.inf, 1.0))]))
    with pytest.raises(ValueError, match="learning.sweep.dimensions"):
        best_settings(search)


@pytest.mark.filterwarnings("ignore:The number of trials is too small")  # to tell what matters, which Optuna says
@pytest.mark.parametrize("trials", [2, 12])
def test_every_picture_is_drawn_of_few_trials_and_of_many(journal, trials):
    search, _ = run(journal, trials)
    figures = draw_search(search)
    assert list(figures) == ["history", "importance", "slices", "contours"]
    assert all(figure.axes for figure in figures.values())
