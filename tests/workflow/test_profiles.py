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


def test_the_main_job_on_slurm_asks_for_what_its_rules_need(project):
    """And it trains by the paper's own method where the targets name it."""
    trials = project.folder / "results/data/bench_elbow/trials.parquet"
    trials.parent.mkdir(parents=True)
    trials.write_bytes(bytes(2**20))  # 60 trials of 500 samples, which took 2.8 GB
    done = project.snakemake("-n", "--profile", "profiles/slurm", "--rerun-triggers", "mtime")
    assert done.returncode == 0, done.stdout
    jobs = re.findall(r"(?:rule|checkpoint) (\w+):\n    (.*?resources: [^\n]*)", done.stdout, re.DOTALL)
    asked = {(rule, re.search("dataset=(\\w+)", text)[1]): text for rule, text in jobs if "dataset=" in text}
    imports, diagnosis = asked["import_trials", "human_curls"], asked["diagnose_dataset", "bench_elbow"]
    assert "mem_mb=800" in imports and "runtime=10" in imports and "runtime=30" in diagnosis
    assert int(re.search(r"mem_mb=(\d+)", diagnosis)[1]) > 2800, "memory follows the size of a dataset"
    for scales in (1, 3):
        assert f"results/learning/case1/base/paper_split/{scales}-scale/evaluation.csv" in done.stdout
