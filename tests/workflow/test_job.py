"""What a job shows while it runs."""

import errno
import io
import os
import sys
from pathlib import Path

import pytest

from myowave.workflow.job import check_folder, check_writable, job_log


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_users_mistake_ends_the_job_with_its_message_and_no_traceback(tmp_path):
    path = tmp_path / "logs/import/case1.log"
    with pytest.raises(SystemExit) as ended, job_log("import case1", path):
        raise ValueError("trial2.csv, row 118: time goes back")
    assert ended.value.code == 1
    assert path.read_text() == "import case1\nimport case1: trial2.csv, row 118: time goes back\n"


def test_a_mistake_of_ours_is_not_hidden(tmp_path):
    with pytest.raises(AssertionError), job_log("train", tmp_path / "train.log"):
        raise AssertionError("shapes differ")
    log = (tmp_path / "train.log").read_text()
    assert "Traceback" in log and "shapes differ" in log and Path(__file__).name in log


@pytest.mark.parametrize("terminal", [Terminal(), io.StringIO()])
def test_what_is_announced_is_in_the_log_and_on_the_terminal(tmp_path, monkeypatch, terminal):
    monkeypatch.setattr(sys, "stderr", terminal)
    with job_log("sweep", tmp_path / "sweep.log") as log:
        log.announce("best of 20\nat the edge")
    assert (tmp_path / "sweep.log").read_text() == "sweep\nbest of 20\nat the edge\n"
    assert "best of 20\nat the edge\n" in terminal.getvalue()


@pytest.mark.parametrize("terminal", [Terminal(), io.StringIO()])
def test_progress_logs_little_and_its_end_and_draws_only_on_a_terminal(tmp_path, monkeypatch, terminal):
    monkeypatch.setattr(sys, "stderr", terminal)
    with job_log("train case1", tmp_path / "train.log") as log:
        for epoch in range(1, 101):
            log.progress(epoch, 100, f"loss {1 / epoch:.1e}")
    lines = (tmp_path / "train.log").read_text().splitlines()
    assert lines[-1] == "100/100 (100%) loss 1.0e-02"
    assert len(lines) < 10, "a fast job writes few lines"
    assert ("train case1" in terminal.getvalue()) == terminal.isatty()


@pytest.mark.parametrize("why", [errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EROFS])
def test_a_full_disk_is_said_on_the_terminal_and_ends_the_job(why, tmp_path, capfd):
    with pytest.raises(SystemExit), job_log("train case1", tmp_path / "logs/train.log"):
        raise OSError(why, os.strerror(why), "results/x.pt")
    said = capfd.readouterr().err
    assert said.startswith(f"train case1: results/x.pt: {os.strerror(why)}. Make room")
    with pytest.raises(OSError, match="gone"), job_log("train case1", tmp_path / "logs/train.log"):
        raise OSError(errno.ENOENT, "gone")  # ours, with its traceback


def test_results_that_may_not_be_written_are_said_before_anything_runs(tmp_path, monkeypatch):
    check_writable(tmp_path / "not there yet")
    check_writable(tmp_path)
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # root may write anywhere but on a read-only disk
    with pytest.raises(ValueError, match=f"{tmp_path} cannot be written; nothing was run"):
        check_writable(tmp_path)


def test_a_file_in_the_place_of_the_results_is_said_before_anything_runs(tmp_path):
    check_folder(tmp_path / "not there yet")
    check_folder(tmp_path)
    (tmp_path / "results").touch()
    with pytest.raises(ValueError, match=f"{tmp_path}/results is no folder; nothing was run"):
        check_folder(tmp_path / "results")
