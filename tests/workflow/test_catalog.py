"""The repository follows the Snakemake workflow catalog, and its example as a module of another workflow works."""

import re
import shutil

import yaml
from project_copy import ROOT, Project


def blocks(language: str) -> list[str]:
    """Code of this language in config/README.md."""
    text = (ROOT / "config/README.md").read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def test_the_catalog_reads_how_the_workflow_is_used():
    usage = yaml.safe_load((ROOT / ".snakemake-workflow-catalog.yml").read_text(encoding="utf-8"))["usage"]
    assert set(usage) == {"mandatory-flags", "software-stack-deployment", "report"}
    assert {section for section in yaml.safe_load((ROOT / "config.yaml").read_text())} == set(
        re.findall(r"^\| `(\w+)`", (ROOT / "config/README.md").read_text(), re.MULTILINE)
    ), "every section of the settings is told"


def test_another_workflow_takes_this_one_as_a_module(tmp_path):
    (tmp_path / "myowave").symlink_to(ROOT)
    shutil.copy(ROOT / "config.yaml", tmp_path)
    for arm in ("arm26", "arm26_brd"):
        shutil.copytree(ROOT / "data" / arm, tmp_path / "data" / arm)
    shutil.copytree(ROOT / "data/bench_elbow", tmp_path / "recordings")
    (snakefile,), (settings,) = blocks("python"), blocks("yaml")
    (tmp_path / "Snakefile").write_text(snakefile)
    (tmp_path / "mine.yaml").write_text(settings)
    project = Project(tmp_path, sources=ROOT / "src")
    arguments = ("--cores", "1", "--configfile", "config.yaml", "mine.yaml")
    planned = project.planned(*arguments)
    assert planned["train_scale"] == planned["diagnose_dataset"] == planned["list_datasets"] == 1
    done = project.snakemake("results/data/me/trials.parquet", *arguments)
    assert done.returncode == 0 and (tmp_path / "results/data/me/trials.parquet").exists(), done.stdout
