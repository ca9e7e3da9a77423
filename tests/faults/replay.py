"""Put each deliberate fault of faults.yaml into a copy of the code and see its tests fail: `make mutants`.

    python tests/faults/replay.py [part ...]     faults whose place has one of these in it; all where none is named
    python tests/faults/replay.py --update       rewrite the rows whose code has moved, and say which are lost

A fault that survives is a hole in the tests: mend the test, not the list.
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

sys.path.insert(0, str(Path(__file__).parent))
from faults import ROOT, Fault, LostError, files_of, path_of, read_faults, update, with_fault

KEPT_OUT = shutil.ignore_patterns(".venv", ".git", "results", ".snakemake", "__pycache__", "*.egg-info", "elbow_curls")


def outcome(fault: Fault, project: Path) -> str:
    """What the tests make of a fault in a copy of the project, which is then as it was."""
    try:
        spoilt = with_fault(fault, project)
    except LostError as error:
        return f"LOST ({error})"
    tests = [f"{file}::{test}" for test in fault.killed_by for file in files_of(test, project)]
    if not tests:
        return "LOST (no such test)"
    path = project / path_of(fault.module)
    sound = path.read_text(encoding="utf-8")
    path.write_text(spoilt, encoding="utf-8")
    try:
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests]
        environment = os.environ | {"PYTHONPATH": str(project / "src"), "OMP_NUM_THREADS": "1"}
        ended = subprocess.run(command, cwd=project, env=environment, capture_output=True, text=True)
        if ended.returncode in (0, 1):
            return "killed" if ended.returncode else "SURVIVES"
        return f"LOST (pytest: {ended.stdout[-300:]})"
    finally:
        path.write_text(sound, encoding="utf-8")


def replay(faults: list[Fault]) -> int:
    """Try faults, one on each core at a time; returns how many were not killed."""
    cores, start = len(os.sched_getaffinity(0)), time.monotonic()
    free: SimpleQueue[Path] = SimpleQueue()  # copies of the project that no fault is in
    left = 0
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(cores) as pool:
        for core in range(cores):
            free.put(Path(shutil.copytree(ROOT, Path(folder, str(core), "project"), ignore=KEPT_OUT)))

        def try_one(fault: Fault) -> str:
            project = free.get()
            try:
                return outcome(fault, project)
            finally:
                free.put(project)

        for n, (fault, said) in enumerate(zip(faults, pool.map(try_one, faults), strict=True), 1):
            left += said != "killed"
            print(f"{n}/{len(faults)} {said}  {str(fault)[:150]}", flush=True)
    minutes = (time.monotonic() - start) / 60
    print(f"{len(faults) - left} of {len(faults)} faults were killed, in {minutes:.0f} min on {cores} cores.")
    return left


def main(arguments: list[str]) -> int:
    if arguments == ["--update"]:
        lost = update()
        for fault in lost:
            print(f"LOST  {fault}")
        faults = read_faults()
        untested = [f for f in faults if not all(files_of(test, ROOT) for test in f.killed_by)]
        for fault in untested:
            print(f"NO TEST {' '.join(fault.killed_by)}  {fault}")
        print(f"{len(lost)} of {len(faults)} rows have no place in the code, {len(untested)} no test: mend or delete.")
        return bool(lost or untested)
    faults = [f for f in read_faults() if not arguments or any(part in f.place for part in arguments)]
    return replay(faults) > 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
