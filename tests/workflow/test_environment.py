"""`make` sets its environment up, also where it was killed while it did so."""

import os
import shutil
import subprocess
import sys

import pytest
from project_copy import ROOT

# Stands for Python: makes an environment with a pip that notes what it is asked for.
PYTHON = f"""#!{sys.executable}
import os, sys
if sys.argv[1:3] == ["-m", "venv"]:
    folder = sys.argv[-1]
    os.makedirs(folder + "/bin", exist_ok=True)
    open("made.txt", "a").write(" ".join(sys.argv[3:]) + chr(10))
    with open(folder + "/bin/python", "w") as file:
        file.write("#!/bin/sh" + chr(10) + "echo $@ >> pip.txt" + chr(10))
    os.chmod(folder + "/bin/python", 0o755)
"""


@pytest.fixture
def folder(tmp_path):
    for name in ("Makefile", "environment.lock", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    (tmp_path / "python").write_text(PYTHON)
    (tmp_path / "python").chmod(0o755)
    return tmp_path


def make(folder):
    done = subprocess.run(
        ["make", "PYTHON=./python", ".venv/.ready"], cwd=folder, capture_output=True, text=True, env=os.environ
    )
    assert done.returncode == 0, done.stderr
    assert "-r environment.lock" in (folder / "pip.txt").read_text()


def left(folder, text):
    """An environment as a killed `make` leaves it, whose Python does this."""
    (folder / ".venv/bin").mkdir(parents=True)
    (folder / ".venv/bin/python").write_text(f"#!/bin/sh\n{text}\n")
    (folder / ".venv/bin/python").chmod(0o755)


def test_an_environment_is_made_where_there_is_none(folder):
    make(folder)
    assert (folder / "made.txt").read_text().endswith(".venv\n")


def test_one_that_was_killed_before_it_had_pip_is_made_anew(folder):
    left(folder, "echo No module named pip >&2; exit 1")
    make(folder)
    assert (folder / "made.txt").read_text() == "--clear .venv\n"


def test_one_that_was_killed_later_is_gone_on_with(folder):
    left(folder, "echo $@ >> pip.txt")
    make(folder)
    assert not (folder / "made.txt").exists()
