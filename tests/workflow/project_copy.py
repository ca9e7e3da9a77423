"""A copy of the project to run Snakemake in, away from the results of the one that is tested."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
PARTS = ("Snakefile", "config.yaml", "workflow", "profiles", "src", "data", "studies")
# A sweep of seconds; a test adds how many trials it wants.
SMALL_SWEEP = {
    "dataset": "case1",
    "recipe": "rollout",
    "scales": 2,
    "epochs": 6,
    "seeds": 2,
    "dimensions": {"history_steps": {"low": 2, "high": 5}, "hidden": {"low": 4, "high": 12}},
}


@dataclass(frozen=True)
class Project:
    """A copy of the project; its own `src` is what runs, unless `sources` names another."""

    folder: Path
    sources: Path | None = None

    def snakemake(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run Snakemake there; stdout and stderr come together in `stdout`."""
        return self.run("-m", "snakemake", *arguments)

    def run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        environment = os.environ | {"PYTHONPATH": str(self.sources or self.folder / "src"), "OMP_NUM_THREADS": "1"}
        return subprocess.run(
            [sys.executable, *arguments],
            cwd=self.folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=1200,  # far beyond what any takes, on a machine that is busy too
        )

    def planned(self, *arguments: str) -> dict[str, int]:
        """Jobs that a dry run wants: {rule: number}, without the target itself."""
        done = self.snakemake("-n", *arguments)
        assert done.returncode == 0, done.stdout
        table = re.search(r"^job +count\n[- ]+\n(.*?)^total", done.stdout, re.MULTILINE | re.DOTALL)
        if table is None:
            assert "Nothing to be done" in done.stdout, done.stdout
            return {}
        jobs = {rule: int(count) for rule, count in (line.split() for line in table[1].splitlines())}
        jobs.pop("all", None)
        return jobs

    def finish(self, *arguments: str) -> None:
        """Put every output there by hand and record it as done, with the params its rule has now."""
        summary = self.snakemake("--detailed-summary", *arguments).stdout
        outputs = [line.split("\t")[0] for line in summary.splitlines() if line.startswith("results/")]
        assert outputs, summary
        for output in outputs:
            path = self.folder / output
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("made by hand")
        done = self.snakemake("--touch", "--forceall", "--cores", "1", *arguments)
        assert done.returncode == 0, done.stdout

    def recorded(self) -> list[dict]:
        """What Snakemake recorded of each output: rule, input, params, ..."""
        return [json.loads(p.read_text()) for p in (self.folder / ".snakemake/metadata").iterdir() if p.is_file()]

    def lay_over(self, config: dict) -> tuple[str, ...]:
        """Arguments that lay a configuration over the shipped one; only the targets that it names are made."""
        targets = {"without_networks": [], "own_recipes": {"case1": None}, **config.get("targets", {})}
        (self.folder / "mine.yaml").write_text(yaml.safe_dump(config | {"targets": targets}))
        return ("--configfile", "config.yaml", "mine.yaml")


def copy_project(folder: Path) -> Project:
    for part in PARTS:
        source = ROOT / part
        if source.is_dir():
            shutil.copytree(source, folder / part, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
        else:
            shutil.copy2(source, folder / part)
    return Project(folder)
