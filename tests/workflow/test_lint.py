"""Snakemake's own linter, and how fast the workflow is read."""

import re
import time

from project_copy import ROOT, Project

# Software comes from environment.lock, for all rules alike.
ACCEPTED = {"Specify a conda environment or container for each rule"}


def test_snakemake_finds_nothing_to_complain_of_but_the_environment():
    done = Project(ROOT).snakemake("--lint")
    titles = re.findall(r"^    \* (.+?)\.?:$", done.stdout, re.MULTILINE)
    assert titles, done.stdout
    assert set(titles) <= ACCEPTED, done.stdout


def test_a_dry_run_takes_seconds(project):
    times = []
    for _ in range(2):
        start = time.perf_counter()
        project.planned()
        times.append(time.perf_counter() - start)
    assert min(times) < 3 * 2, "3 s when nothing else runs; twice that where tests run side by side"
