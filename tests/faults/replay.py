"""Put each deliberate fault of faults.yaml into a copy of the code and see its tests fail: `make mutants`.

A fault that survives is a hole in the tests: mend the test, not the list. Names after the command choose faults by a part
of their file's path.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).parents[2]
FAULTS = Path(__file__).with_name("faults.yaml")
KEPT_OUT = shutil.ignore_patterns(".venv", ".git", "results", ".snakemake", "__pycache__", "*.egg-info", "elbow_curls")


def read_faults() -> list[dict[str, Any]]:
    """The faults: file, old and new text, and `killed_by`, the tests that know it."""
    faults: list[dict[str, Any]] = yaml.safe_load(FAULTS.read_text(encoding="utf-8"))
    return faults


def survives(fault: dict[str, Any], project: Path) -> bool:
    """Whether the tests pass with the fault in a copy of the project, which is then as it was."""
    path = project / fault["file"]
    sound = path.read_text(encoding="utf-8")
    path.write_text(sound.replace(fault["old"], fault["new"]), encoding="utf-8")
    try:
        tests = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *fault["killed_by"]]
        environment = os.environ | {"PYTHONPATH": str(project / "src"), "OMP_NUM_THREADS": "1"}
        return subprocess.run(tests, cwd=project, env=environment, capture_output=True).returncode == 0
    finally:
        path.write_text(sound, encoding="utf-8")


def main(chosen: list[str]) -> int:
    faults = [f for f in read_faults() if not chosen or any(part in f["file"] for part in chosen)]
    survivors = 0
    with tempfile.TemporaryDirectory() as folder:
        project = Path(folder, "project")
        shutil.copytree(ROOT, project, ignore=KEPT_OUT)
        for n, fault in enumerate(faults, 1):
            alive = survives(fault, project)
            survivors += alive
            print(
                f"{n}/{len(faults)} {'SURVIVES' if alive else 'killed'}  {fault['file']}: {fault['new'][:80]!r}",
                flush=True,
            )
    print(f"{len(faults) - survivors} of {len(faults)} faults were killed.")
    return int(survivors > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
