"""Snakemake's own linter; `make lint` runs the others."""

import re

from project_copy import ROOT, Project

ACCEPTED = {
    "Specify a conda environment or container for each rule",  # software comes from environment.lock, for all alike
    "Mixed rules and functions in same snakefile",  # what only the rules of one file use stands beside them
}


def test_snakemake_finds_nothing_to_complain_of_but_what_is_meant_so():
    done = Project(ROOT).snakemake("--lint")
    titles = re.findall(r"^    \* (.+?)\.?:$", done.stdout, re.MULTILINE)
    assert titles, done.stdout
    assert set(titles) <= ACCEPTED, done.stdout
