"""About how long a run still takes: what its jobs usually take, moved by those that have ended in it.

Snakemake says how many jobs are left, but one takes a second and another two minutes. Its scheduler tells the handler
below when a job starts and ends.
"""

import logging
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

# What a job of a rule usually takes [s]: means over the main job on two cores; of the others what profiles/slurm says.
USUAL_S = {
    "compare_rooms": 7.0,
    "diagnose_dataset": 54.0,
    "draw_diagnosis": 9.0,
    "draw_models": 4.0,
    "draw_recording": 14.0,
    "draw_trials": 8.5,
    "evaluate_model": 4.0,
    "import_trials": 4.0,
    "prepare_recording": 8.0,
    "publish_runs": 17.0,
    "score_sweep": 170.0,
    "search_settings": 360.0,
    "simulate_trials": 7.0,
    "study_world": 150.0,
    "train_scale": 24.0,
}
OTHER_S = 1.0
ENOUGH_S = 20.0  # of usual times have passed before the machine's pace counts more than that of the one measured on
LATE = 0.1  # of its time is still expected of a job that should have ended
TELL_EVERY_S = 20.0


@dataclass(frozen=True)
class Job:
    """A job that has not ended: its rule, its threads, and the time since it started [s], if it has."""

    rule: str
    threads: int = 1
    since: float | None = None


class Durations:
    """What a job of each rule takes in this run."""

    def __init__(self, usual: Mapping[str, float] = USUAL_S) -> None:
        self._usual = usual
        self._taken: defaultdict[str, float] = defaultdict(float)
        self._ended: Counter[str] = Counter()

    def add(self, rule: str, seconds: float) -> None:
        """A job of the rule has ended."""
        self._taken[rule] += seconds
        self._ended[rule] += 1

    def seen(self, rule: str) -> bool:
        """Whether a job of the rule has ended in this run."""
        return self._ended[rule] > 0

    def of(self, rule: str) -> float:
        """Expected time [s]: the usual one at this machine's pace counts as much as one job that has ended."""
        usual = sum(self._usual.get(name, OTHER_S) * count for name, count in self._ended.items())
        pace = (ENOUGH_S + sum(self._taken.values())) / (ENOUGH_S + usual)
        expected = pace * self._usual.get(rule, OTHER_S)
        return (expected + self._taken.get(rule, 0.0)) / (1 + self._ended[rule])


def seconds_left(jobs: Iterable[Job], durations: Durations, cores: int) -> float:
    """Time until the last of these jobs has ended [s], on cores that are never idle while there is work."""
    work = longest = 0.0
    for job in jobs:
        expected = durations.of(job.rule)
        left = expected if job.since is None else max(expected - job.since, LATE * expected)
        work += left * min(job.threads, cores)
        longest = max(longest, left)
    return max(longest, work / cores)


def tell(jobs: Iterable[Job], durations: Durations, cores: int) -> str:
    """The time left for people, and a warning where most of it is of rules that this run has not seen end."""
    jobs = list(jobs)
    seconds = seconds_left(jobs, durations, cores)
    text = f"{_rounded(seconds)} left"
    times = [(durations.of(job.rule) * job.threads, durations.seen(job.rule)) for job in jobs]
    if seconds > 60 and 2 * sum(t for t, seen in times if seen) < sum(t for t, _ in times):
        text += ", if jobs take as long as with the shipped settings"
    return text


def _rounded(seconds: float) -> str:
    minutes = round(seconds / 60)
    if minutes < 1:
        return "Less than a minute"
    return f"About {minutes} min" if minutes < 90 else f"About {minutes // 60} h {minutes % 60} min"


class TimeLeft(logging.Handler):
    """Listens to the log of Snakemake, and says now and then how long the run still takes.

    Args:
        jobs: {number: job} of all jobs that have not ended, whenever it is asked.
        cores: that run jobs.
        say: told the time left.
        clock: seconds.
    """

    def __init__(
        self,
        jobs: Callable[[], Mapping[int, Job]],
        cores: int,
        say: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__()
        self._jobs, self._cores, self._say, self._clock = jobs, cores, say, clock
        self._durations = Durations()
        self._started: dict[int, tuple[str, float]] = {}
        self._told = float("-inf")

    def emit(self, record: logging.LogRecord) -> None:
        """Take notice of a job that starts or has ended; nothing that fails here may end a run."""
        event = getattr(getattr(record, "event", None), "name", "")
        try:
            if event == "JOB_STARTED":
                self._start(getattr(record, "jobs", ()))
            elif event == "JOB_FINISHED":
                self._finish(getattr(record, "job_id", None))
        except Exception:
            self.handleError(record)

    def _start(self, numbers: Iterable[int]) -> None:
        now, jobs = self._clock(), self._jobs()
        self._started |= {n: (jobs[n].rule, now) for n in numbers if n in jobs}
        if now - self._told < TELL_EVERY_S:
            return
        self._told = now
        since = {n: now - began for n, (_, began) in self._started.items()}
        left = [Job(job.rule, job.threads, since.get(n)) for n, job in jobs.items()]
        self._say(tell(left, self._durations, self._cores))

    def _finish(self, number: int | None) -> None:
        if number in self._started:
            rule, began = self._started.pop(number)
            self._durations.add(rule, self._clock() - began)
