"""How long does the workflow take to start? Processor time of `snakemake --dry-run` with every job still to be done.

Beside it: a workflow of one rule, which is Snakemake's own share, and the first start after all of the code changed,
when what was read of it (myowave.workflow.digest) is not kept yet. The least of three runs each. Wanted: below 3 s.
"""

import os
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PARTS = ("Snakefile", "config.yaml", "workflow", "profiles", "src", "data")
ONE_RULE = 'rule all:\n    output: "done"\n    shell: "touch {output}"\n'
RUNS = 3


def main() -> None:
    with tempfile.TemporaryDirectory() as empty, tempfile.TemporaryDirectory() as copy:
        Path(empty, "Snakefile").write_text(ONE_RULE)
        for part in map(Path, PARTS):
            (shutil.copytree if part.is_dir() else shutil.copy)(part, Path(copy, part))
        own = min(dry_run(Path(empty)) for _ in range(RUNS))
        first = min(dry_run(forgotten(Path(copy))) for _ in range(RUNS))
        again = min(dry_run(Path(copy)) for _ in range(RUNS))
    print(f"dry run of all jobs: {again:.2f} s of processor time, of which Snakemake's own {own:.2f} s")
    print(f"the first after all of the code changed: {first:.2f} s")


def dry_run(folder: Path) -> float:
    """Processor time of one dry run [s]."""
    environment = os.environ | {"PYTHONPATH": str(folder / "src")}
    before = processor_time()
    command = [sys.executable, "-m", "snakemake", "--dry-run", "--quiet"]
    subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)
    return processor_time() - before


def processor_time() -> float:
    """Of all processes that this one started and that ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def forgotten(folder: Path) -> Path:
    """The folder, without what was kept of the code."""
    for kept in folder.rglob("*.digest.json"):
        kept.unlink()
    return folder


if __name__ == "__main__":
    main()
