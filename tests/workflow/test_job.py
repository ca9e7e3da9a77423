"""What a job shows while it runs."""

import errno
import io
import multiprocessing
import os
import re
import time
from dataclasses import dataclass

import pytest

from myowave.workflow.job import JobLog, check_writable, follow, job_log


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@dataclass
class Report:
    epoch: int

    def summary(self) -> str:
        return f"loss {1 / self.epoch:.1e}"


def test_a_users_mistake_ends_the_job_with_its_message_and_no_traceback(tmp_path):
    path = tmp_path / "logs/import/case1.log"
    with pytest.raises(SystemExit) as ended, job_log("import case1", path):
        raise ValueError("trial2.csv, row 118: time goes back")
    assert ended.value.code == 1
    assert path.read_text() == "import case1\nimport case1: trial2.csv, row 118: time goes back\n"


def test_a_mistake_of_ours_is_not_hidden(tmp_path):
    with pytest.raises(AssertionError), job_log("train", tmp_path / "train.log"):
        raise AssertionError("shapes differ")


@pytest.mark.parametrize("terminal", [Terminal(), io.StringIO()])
def test_what_is_announced_is_in_the_log_and_on_the_terminal(tmp_path, terminal):
    text = io.StringIO()
    JobLog("sweep", text, tmp_path, terminal).announce("best of 20\nat the edge")
    assert text.getvalue() == "best of 20\nat the edge\n"
    assert terminal.getvalue().endswith("best of 20\nat the edge\n")


def test_following_hands_on_every_report_and_logs_the_last(tmp_path):
    path = tmp_path / "train.log"
    with job_log("train case1", path) as log:
        assert [report.epoch for report in follow(map(Report, range(1, 101)), 100, log)] == list(range(1, 101))
    lines = path.read_text().splitlines()
    assert lines[-1] == "100/100 (100%) loss 1.0e-02, 0:00:00 left"
    assert len(lines) < 10, "a fast job writes few lines"


def test_the_time_left_is_that_of_the_steps_to_come(tmp_path, monkeypatch):
    now = 1000.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    text = io.StringIO()
    log = JobLog("train", text, tmp_path, io.StringIO())
    now += 60
    log.progress(25, 100)
    assert text.getvalue().rstrip().endswith("0:03:00 left")


def test_jobs_side_by_side_share_one_line_of_the_terminal(tmp_path, monkeypatch):
    terminal = Terminal()
    other = tmp_path / str(os.getpid() + 1)
    log = JobLog("train case1", io.StringIO(), tmp_path, terminal)
    monkeypatch.setenv("COLUMNS", "80")
    other.write_text("40%, 0:00:03 left: train case2, " + "many numbers " * 20)
    log.progress(1, 2, "loss 0.1")
    shown = re.split(r"\r\x1b\[K", terminal.getvalue())[-1]
    assert "50%, 0:00:00 left: train case1, loss" in shown and "40%, 0:00:03 left: train case2" in shown
    assert len(shown) <= 80
    assert shown.endswith("\r") and "\n" not in shown, "the next to print overwrites the line"
    log.close()
    assert "case1" not in re.split(r"\r\x1b\[K", terminal.getvalue())[-1]


def test_the_state_of_a_killed_job_is_forgotten(tmp_path):
    dead = tmp_path / "999999"
    dead.write_text("train case9 10%")
    os.utime(dead, (time.time() - 1000,) * 2)
    terminal = Terminal()
    JobLog("train case1", io.StringIO(), tmp_path, terminal).progress(1, 2)
    assert "case9" not in terminal.getvalue() and not dead.exists()


def test_without_a_terminal_plain_lines_come_now_and_then(tmp_path):
    stream = io.StringIO()
    log = JobLog("train case1", io.StringIO(), tmp_path, stream)
    for step in range(1, 1001):
        log.progress(step, 1000)
    lines = stream.getvalue().splitlines()
    assert 2 <= len(lines) <= 3 and all(line.startswith("train case1: ") for line in lines)


def _work(folder: str) -> None:
    with job_log("work", f"{folder}/logs/{os.getpid()}.log") as log:
        log._terminal = Terminal()
        for step in range(1, 200):
            log._last["terminal"] = float("-inf")
            log.progress(step, 200)


def test_many_jobs_may_come_and_go_at_once(tmp_path):
    with multiprocessing.get_context("fork").Pool(4) as pool:
        pool.map(_work, [str(tmp_path)] * 12)
    assert not list((tmp_path / "logs/.running").iterdir())


def test_a_full_disk_is_said_on_the_terminal_and_ends_the_job(tmp_path, capfd):
    with pytest.raises(SystemExit), job_log("train case1", tmp_path / "logs/train.log"):
        raise OSError(errno.ENOSPC, "No space left on device", "results/x.pt")
    said = capfd.readouterr().err
    assert said.startswith("train case1: results/x.pt: No space left on device. Make room")
    with pytest.raises(OSError, match="gone"), job_log("train case1", tmp_path / "logs/train.log"):
        raise OSError(errno.ENOENT, "gone")  # ours, with its traceback


def test_results_that_may_not_be_written_are_said_before_anything_runs(tmp_path, monkeypatch):
    check_writable(tmp_path / "not there yet")
    check_writable(tmp_path)
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # root may write anywhere but on a read-only disk
    with pytest.raises(ValueError, match=f"{tmp_path} cannot be written; nothing was run"):
        check_writable(tmp_path)
