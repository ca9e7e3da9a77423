"""What a job of the workflow shows while it runs: its log, its progress, and a user's mistake without a traceback.

Jobs run side by side and share one terminal. Each writes plain lines to its own log. On the terminal there is one line
that updates and holds all running jobs: every job leaves its state in a folder, and whoever has news redraws the line.
Where stderr is no terminal, each job writes a plain line there now and then.
"""

import errno
import os
import shutil
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path
from typing import Any, TextIO

LOG_EVERY_S = 10.0
PLAIN_EVERY_S = 30.0
REDRAW_EVERY_S = 0.5
_ESTIMATE_FROM = 0.02  # share of the steps; before, starting up dominates
_BETWEEN = " | "
_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)  # full, over its quota, only to be read
_STALE_S = 120.0  # a job that was killed leaves its state behind


class JobLog:
    """The log of one job and its part of the terminal.

    Args:
        label: what the job works on, for people: "train case1 base rollout 3-scale, scale -2".
        log: opened log file.
        board: folder where running jobs leave their state.
        terminal: usually stderr.
    """

    def __init__(self, label: str, log: TextIO, board: Path, terminal: TextIO = sys.stderr):
        self.label = label
        self._log = log
        self._terminal = terminal
        self._state = board / str(os.getpid())
        self._started = time.monotonic()
        self._last = dict.fromkeys(("log", "terminal"), float("-inf"))
        board.mkdir(parents=True, exist_ok=True)

    def say(self, text: str) -> None:
        """A line in the log."""
        print(text, file=self._log, flush=True)

    def announce(self, text: str) -> None:
        """Lines for whoever started the run: in the log and on the terminal."""
        self.say(text)
        clear = "\r\x1b[K" if self._terminal.isatty() else ""
        print(f"{clear}{text}", file=self._terminal, flush=True)

    def progress(self, done: int, total: int, text: str = "") -> None:
        """How far the job is. Cheap to call often.

        Args:
            done, total: steps.
            text: numbers of interest, such as `loss 1.2e-04`.
        """
        left = self._left(done, total)
        line = f"{done}/{total} ({done / total:.0%}) {text}{left}"
        if self._due("log", LOG_EVERY_S, done == total):
            self.say(line)
        updating = self._terminal.isatty()
        if self._due("terminal", REDRAW_EVERY_S if updating else PLAIN_EVERY_S, done == total):
            if updating:
                self._state.write_text(f"{done / total:.0%}{left}: {self.label}, {text}")
                self._redraw()
            else:
                print(f"{self.label}: {line}", file=self._terminal, flush=True)

    def close(self) -> None:
        """Take the job off the terminal's line."""
        self._state.unlink(missing_ok=True)
        if self._terminal.isatty():
            self._redraw()

    def _left(self, done: int, total: int) -> str:
        """The time that is left, once it can be told."""
        if done < _ESTIMATE_FROM * total:
            return ""
        seconds = (time.monotonic() - self._started) / done * (total - done)
        return f", {timedelta(seconds=round(seconds))} left"

    def _due(self, where: str, interval: float, finished: bool) -> bool:
        now = time.monotonic()
        if now - self._last[where] < interval and not finished:
            return False
        self._last[where] = now
        return True

    def _redraw(self) -> None:
        states = _running(self._state.parent)
        share = (shutil.get_terminal_size().columns - 1) // max(len(states), 1) - len(_BETWEEN)
        line = _BETWEEN.join(state[:share] for state in states)
        # The cursor goes back to the start, so that what others print next overwrites the line.
        print(f"\r\x1b[K{line}\r", end="", file=self._terminal, flush=True)


def _running(board: Path) -> list[str]:
    """States of the jobs that run, those that died left out."""
    states = []
    for path in sorted(board.iterdir()):
        try:
            if time.time() - path.stat().st_mtime < _STALE_S:
                states.append(path.read_text())
            else:
                path.unlink()
        except FileNotFoundError:  # that job ended between listing and reading
            continue
    return states


@contextmanager
def job_log(label: str, path: str | Path) -> Iterator[JobLog]:
    """Run a job under its log.

    A ValueError is a user's mistake: its message goes to the log and the job ends with exit status 1. It ends likewise
    where the disk is full or may not be written; as the log may lie on it, that is said on the terminal. Anything else
    is ours, and goes to the log with its traceback.

    Args:
        label: what the job works on.
        path: the log file; the board of running jobs is beside the logs' folder.
    """
    path = Path(path)
    try:
        with _opened_log(label, path) as log:
            yield log
    except OSError as error:
        if error.errno not in _DISK:
            raise
        where = f"{error.filename}: " if error.filename else ""
        print(f"{label}: {where}{error.strerror}. Make room, or allow writing there; then run again.", file=sys.stderr)
        raise SystemExit(1) from None


def check_writable(folder: str | Path) -> None:
    """Raise a ValueError where a folder is there and may not be written."""
    if Path(folder).exists() and not os.access(folder, os.W_OK):
        raise ValueError(f"{Path(folder).resolve()} cannot be written; nothing was run. Allow writing there.")


@contextmanager
def _opened_log(label: str, path: Path) -> Iterator[JobLog]:
    path.parent.mkdir(parents=True, exist_ok=True)
    board = next((p for p in path.parents if p.name == "logs"), path.parent) / ".running"
    with path.open("w", encoding="utf-8") as file:
        log = JobLog(label, file, board)
        log.say(label)
        try:
            yield log
        except ValueError as error:
            log.say(f"{label}: {error}")
            raise SystemExit(1) from None
        finally:
            log.close()


def follow(reports: Iterable[Any], total: int, log: JobLog) -> Iterator[Any]:
    """Hand on reports that have `epoch` (from 1) and `summary()`, showing each as progress."""
    for report in reports:
        log.progress(report.epoch, total, report.summary())
        yield report
