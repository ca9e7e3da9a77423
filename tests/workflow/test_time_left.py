"""How long a run still takes, as it is told while Snakemake works."""

import logging
from enum import Enum

import pytest

from myowave.workflow.time_left import OTHER_S, TELL_EVERY_S, USUAL_S, Durations, Job, TimeLeft, seconds_left, tell

Event = Enum("Event", ["JOB_STARTED", "JOB_FINISHED", "PROGRESS"])
TRAIN, DIAGNOSE = USUAL_S["train_scale"], USUAL_S["diagnose_dataset"]


def test_work_is_shared_by_the_cores_and_the_longest_job_is_a_bound():
    trains = [Job("train_scale")] * 10
    assert seconds_left(trains, Durations(), 1) == pytest.approx(10 * TRAIN)
    assert seconds_left(trains, Durations(), 2) == pytest.approx(5 * TRAIN)
    assert seconds_left([Job("diagnose_dataset")], Durations(), 8) == pytest.approx(DIAGNOSE)
    assert seconds_left([Job("diagnose_dataset", threads=2)] * 3, Durations(), 2) == pytest.approx(3 * DIAGNOSE)
    assert seconds_left([Job("never heard of")], Durations(), 1) == OTHER_S
    assert seconds_left([], Durations(), 2) == 0


def test_a_job_that_runs_counts_with_what_is_left_of_it_and_never_with_nothing():
    half = Job("train_scale", since=TRAIN / 2)
    assert seconds_left([half], Durations(), 1) == pytest.approx(TRAIN / 2)
    assert 0 < seconds_left([Job("train_scale", since=10 * TRAIN)], Durations(), 1) < TRAIN / 5


def test_jobs_that_have_ended_correct_what_is_expected():
    durations = Durations()
    for _ in range(20):
        durations.add("train_scale", 10 * TRAIN)
    assert durations.of("train_scale") == pytest.approx(10 * TRAIN, rel=0.05)
    assert durations.of("diagnose_dataset") == pytest.approx(10 * DIAGNOSE, rel=0.1), "a machine is slow in all rules"
    for _ in range(100):
        durations.add("diagnose_dataset", DIAGNOSE)
    assert durations.of("train_scale") == pytest.approx(10 * TRAIN, rel=0.05), "its own jobs say more than others"
    short = Durations()
    short.add("score_verdict", 10 * OTHER_S)
    assert short.of("train_scale") < 2 * TRAIN, "a job of seconds says little of one of minutes"


def test_a_guess_is_said_to_be_one_until_most_of_what_is_left_was_seen_to_end():
    durations, jobs = Durations(), [Job("train_scale")] * 10 + [Job("watch_ladder")]
    assert tell(jobs, durations, 2) == "About 2 min left, if jobs take as long as with the shipped settings"
    durations.add("watch_ladder", OTHER_S)
    assert "if jobs take" in tell(jobs, durations, 2)
    durations.add("train_scale", TRAIN)
    assert tell(jobs, durations, 2) == "About 2 min left"
    assert tell(jobs[-1:], durations, 2) == "Less than a minute left"
    assert tell(jobs * 100, durations, 2) == "About 3 h 21 min left"


class Run:
    """A run of Snakemake as its log shows it, with a clock of its own."""

    def __init__(self, rules: dict[int, str]):
        self.left = {number: Job(rule) for number, rule in rules.items()}
        self.now, self.said = 0.0, []
        self.log = logging.Logger("of a run")
        self.log.addHandler(TimeLeft(lambda: self.left, 1, self.said.append, lambda: self.now))

    def tell(self, event: Event, **facts):
        self.log.info(None, extra={"event": event, **facts})

    def do(self, number: int, seconds: float):
        self.tell(Event.JOB_STARTED, jobs=[number])
        self.now += seconds
        self.tell(Event.JOB_FINISHED, job_id=number)
        self.tell(Event.PROGRESS, done=1, total=2)
        del self.left[number]


def test_a_run_is_told_the_time_left_as_its_jobs_start_and_not_at_each():
    run = Run(dict.fromkeys(range(50), "train_scale"))
    for number in range(40):
        run.do(number, 60.0)
    assert run.said[0].startswith(f"About {round(50 * TRAIN / 60)} min left, if")
    assert run.said[-1] == "About 11 min left" and len(run.said) == 40
    busy = Run(dict.fromkeys(range(50), "watch_ladder"))
    for number in range(50):
        busy.do(number, 1.0)
    assert len(busy.said) == -(-50 // TELL_EVERY_S)


def test_a_job_that_runs_is_told_with_what_is_left_of_it():
    run = Run({1: "search_settings", 2: "watch_ladder"})
    run.tell(Event.JOB_STARTED, jobs=[1])
    run.now = USUAL_S["search_settings"] - 60
    run.tell(Event.JOB_STARTED, jobs=[2])
    assert run.said[0].startswith("About 6 min left") and run.said[1].startswith("About 1 min left")


def test_what_goes_wrong_in_telling_the_time_ends_no_run(capsys, monkeypatch):
    run = Run({1: "train_scale"})
    run.log.handlers[0]._jobs = None
    run.do(1, 1.0)
    run.tell(Event.JOB_FINISHED, job_id=99)
    run.log.info("a line of no event")
    assert run.said == [] and "TypeError" in capsys.readouterr().err
