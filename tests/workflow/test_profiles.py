"""The profiles ask for what the workflow has."""

import re

import yaml
from project_copy import ROOT

SLURM = yaml.safe_load((ROOT / "profiles/slurm/config.yaml").read_text())
RULES = {
    name: body
    for path in (ROOT / "workflow/rules").glob("*.smk")
    for name, body in re.findall(r"^(?:rule|checkpoint) (\w+):\n((?:    .*\n|\n)*)", path.read_text(), re.MULTILINE)
}


def test_the_slurm_profile_names_rules_that_are_there():
    assert set(SLURM["set-resources"]) | set(SLURM["groups"]) <= set(RULES)
    assert set(SLURM["groups"].values()) == set(SLURM["group-components"])


def test_long_jobs_have_resources_of_their_own_and_go_alone():
    long = {name for name, body in RULES.items() if "benchmark:" in body or "threads:" in body}
    assert long and long == set(SLURM["set-resources"])
    assert not long & set(SLURM["groups"])


def test_jobs_on_slurm_get_the_resources_of_their_rule(project):
    done = project.snakemake("-n", "--profile", "profiles/slurm", "results/diagnosis/bench_elbow/summary.json")
    assert done.returncode == 0, done.stdout
    jobs = dict(re.findall(r"(?:rule|checkpoint) (\w+):\n.*?resources: ([^\n]*)", done.stdout, re.DOTALL))
    assert "mem_mb=800" in jobs["import_trials"] and "runtime=10" in jobs["import_trials"]
    assert "runtime=30" in jobs["diagnose_dataset"]


def test_memory_follows_the_size_of_a_dataset(project):
    trials = project.folder / "results/data/bench_elbow/trials.parquet"
    trials.parent.mkdir(parents=True)
    trials.write_bytes(bytes(2**20))  # 60 trials of 500 samples, which took 2.8 GB
    target = ("--rerun-triggers", "mtime", "--", "results/diagnosis/bench_elbow/summary.json")
    done = project.snakemake("-n", "--profile", "profiles/slurm", *target)
    asked = re.search(r"checkpoint diagnose_dataset:\n.*?mem_mb=(\d+)", done.stdout, re.DOTALL)
    assert asked and int(asked[1]) > 2800, done.stdout
