"""The workflow on a real SLURM of one node: a job killed in the middle, and the same results as without it."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest
from project_copy import SMALL_SWEEP, Project, copy_project
from slurm_node import one_node, why_not

pytestmark = pytest.mark.slurm

SMALL = {
    "targets": {"datasets": ["case1"], "scales": [2]},
    "data": {"datasets": {"case1": {"samples": 150}}},
    "learning": {
        "seeds": 2,
        "recipes": {"rollout": {"epochs": 20, "hidden": 8, "simulated_trials": 2}},
        "sweep": SMALL_SWEEP | {"trials": 4},
    },
}
CONFIG = ("--configfile", "config.yaml", "mine.yaml")
TARGETS = ("results/summary.csv", "results/learning/case1/base/rollout/2-scale/sweep/test_scores.csv")
ON_SLURM = ("--profile", "profiles/slurm", "--latency-wait", "5", "--slurm-init-seconds-before-status-checks", "3")


@pytest.fixture(scope="module")
def slurm(tmp_path_factory) -> Iterator[None]:
    if reason := why_not():
        pytest.skip(reason)
    with one_node(tmp_path_factory.mktemp("slurm")):
        yield


def fresh(folder: Path) -> Project:
    folder.mkdir()
    project = copy_project(folder)
    project.lay_over(SMALL)
    return project


def running_jobs() -> list[str]:
    """What SLURM runs now: id and comment, where Snakemake writes the rule."""
    told = subprocess.run(["squeue", "-h", "-t", "R", "-o", "%i %k"], capture_output=True, text=True).stdout
    return told.splitlines()


def kill_when_running(rule: str, project: Project, workflow: subprocess.Popen, seconds: float) -> None:
    """Kill -9 the process of a rule's job in this project, and no other's, as soon as it runs its script."""
    scripts = f"{project.folder}/.snakemake/scripts/"
    end = time.monotonic() + seconds
    while time.monotonic() < end and workflow.poll() is None:
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                command = (folder / "cmdline").read_bytes().decode().split("\0")
            except OSError:  # it ended meanwhile
                continue
            if len(command) > 1 and command[1].startswith(scripts) and command[1].endswith(f".{rule}.py"):
                os.kill(int(folder.name), signal.SIGKILL)
                return
        time.sleep(0.2)
    running = running_jobs()
    workflow.kill()
    told = workflow.communicate()[0]
    raise AssertionError(f"no job of rule {rule} ran within {seconds} s; running: {running}; Snakemake said: {told}")


def test_a_killed_job_is_made_again_and_the_results_are_those_of_one_machine(slurm, tmp_path):
    local, cluster = fresh(tmp_path / "local"), fresh(tmp_path / "cluster")
    first = subprocess.Popen(
        [sys.executable, "-m", "snakemake", *ON_SLURM, *CONFIG, "--", *TARGETS],
        cwd=cluster.folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=os.environ | {"PYTHONPATH": str(cluster.folder / "src"), "OMP_NUM_THREADS": "1"},
    )
    kill_when_running("train_scale", cluster, first, 240)
    told = first.communicate(timeout=400)[0]
    assert first.returncode != 0 and "train_scale" in told, told
    assert not (cluster.folder / "results/summary.csv").exists()

    again = cluster.snakemake(*ON_SLURM, *CONFIG, "--", *TARGETS)
    assert again.returncode == 0, again.stdout
    done = local.snakemake("--cores", "2", *CONFIG, "--", *TARGETS)
    assert done.returncode == 0, done.stdout

    one, many = (pd.read_csv(p.folder / "results/summary.csv").drop(columns="seconds") for p in (local, cluster))
    pd.testing.assert_frame_equal(one, many)

    tables = [pd.read_csv((p.folder / TARGETS[1]).with_name("trials.csv")) for p in (local, cluster)]
    assert [table["state"].isin(["complete", "pruned"]).sum() for table in tables] == [4, 4]
    names = [(p.folder / TARGETS[1]).with_name("search.txt").read_text() for p in (local, cluster)]
    assert names[0] == names[1], "the same data, settings and code: the studies could be one"
