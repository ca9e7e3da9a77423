"""Put each deliberate fault of faults.yaml into a copy of the code and see its tests fail: `make mutants`.

A fault that survives is a hole in the tests: mend the test, not the list. Arguments choose faults by a part of their
file's path.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
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
    cores, start = len(os.sched_getaffinity(0)), time.monotonic()
    free: SimpleQueue[Path] = SimpleQueue()  # copies of the project that no fault is in
    survivors = 0
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(cores) as pool:
        for core in range(cores):
            free.put(Path(shutil.copytree(ROOT, Path(folder, str(core), "project"), ignore=KEPT_OUT)))

        def try_one(fault: dict[str, Any]) -> bool:
            project = free.get()
            try:
                return survives(fault, project)
            finally:
                free.put(project)

        for n, (fault, alive) in enumerate(zip(faults, pool.map(try_one, faults), strict=True), 1):
            survivors += alive
            print(
                f"{n}/{len(faults)} {'SURVIVES' if alive else 'killed'}  {fault['file']}: {fault['new'][:80]!r}",
                flush=True,
            )
    minutes = (time.monotonic() - start) / 60
    print(f"{len(faults) - survivors} of {len(faults)} faults were killed, in {minutes:.0f} min on {cores} cores.")
    return int(survivors > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
