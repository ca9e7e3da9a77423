"""Snakemake's own linter, and how fast the workflow is read."""

import re
import resource

from project_copy import ROOT, Project

# Software comes from environment.lock, for all rules alike.
ACCEPTED = {"Specify a conda environment or container for each rule"}


def test_snakemake_finds_nothing_to_complain_of_but_the_environment():
    done = Project(ROOT).snakemake("--lint")
    titles = re.findall(r"^    \* (.+?)\.?:$", done.stdout, re.MULTILINE)
    assert titles, done.stdout
    assert set(titles) <= ACCEPTED, done.stdout


def test_a_dry_run_takes_seconds(project):
    def processor_time() -> float:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime

    def dry_run() -> float:
        start = processor_time()
        assert project.planned()
        return processor_time() - start

    assert min(dry_run() for _ in range(3)) < 3.0  # the least of three: other tests share the cores
