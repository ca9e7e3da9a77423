"""What `make lint` runs, and Snakemake's own linter."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from project_copy import ROOT, Project

ACCEPTED = {
    "Specify a conda environment or container for each rule",  # software comes from environment.lock, for all alike
    "Mixed rules and functions in same snakefile",  # what only the rules of one file use stands beside them
}
RECIPE = re.search(r"^lint:.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), re.MULTILINE)
COMMANDS = [line.removeprefix("\t$(BIN)/").split() for line in RECIPE[1].splitlines()]


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_the_code_is_checked_as_make_lint_does(command):
    program = Path(sys.executable).with_name(command[0])
    done = subprocess.run([program, *command[1:]], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_snakemake_finds_nothing_to_complain_of_but_what_is_meant_so():
    done = Project(ROOT).snakemake("--lint")
    titles = re.findall(r"^    \* (.+?)\.?:$", done.stdout, re.MULTILINE)
    assert titles, done.stdout
    assert set(titles) <= ACCEPTED, done.stdout
