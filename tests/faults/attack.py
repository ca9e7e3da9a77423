"""Attack a small job and see that nothing is lost: `make faults`. Not a part of the tests, as it takes an hour.

    python tests/faults/attack.py [kills=40] [load] [disk]     all three where none is named

kills  The job is killed with SIGKILL, all of its processes at once, at random moments, and started again until it is
       done; its summary and predictions are then those of a job that nobody killed, byte by byte.
load   1,000 subjects are planned, and a trial of 100,000 samples is imported and split into scales, within limits.
disk   results/ on a full disk, and on one that may only be read: the run ends with a message that says so, and goes on
       to the same results once there is room. Needs root, as it mounts a disk of a few MB.
"""

import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).parents[1] / "workflow"))
from project_copy import Project, copy_project

SMALL = {
    "targets": {"datasets": ["case1"], "scales": [1, 2], "follow_verdict": []},
    "data": {"datasets": {"case1": {"samples": 120}}},
    "learning": {"seeds": 2, "recipes": {"rollout": {"epochs": 10, "hidden": 4, "simulated_trials": 2}}},
}
CONFIG = ("--configfile", "config.yaml", "mine.yaml")
JOB = ("results/summary.csv", *CONFIG)
TIMING = "seconds"  # the one column of the summary that no two runs share
SUBJECTS, PLAN_S, PLAN_MB = 1000, 120.0, 1500.0
SAMPLES, IMPORT_S, IMPORT_MB = 100_000, 60.0, 1500.0
DISK_KB = 160  # results of the small job need about three times as much


def fresh(folder: Path) -> Project:
    """A copy of the project with the small job."""
    folder.mkdir()
    project = copy_project(folder)
    project.lay_over(SMALL)
    return project


def results(project: Project) -> dict[str, bytes]:
    """What must be the same: the summary without its timing, and all predictions."""
    folder = project.folder / "results"
    summary = pd.read_csv(folder / "summary.csv", dtype=str).drop(columns=TIMING)
    paths = sorted(folder.glob("learning/*/*/*/*-scale/predictions.parquet"))
    return {"summary.csv": summary.to_csv().encode()} | {str(p.relative_to(folder)): p.read_bytes() for p in paths}


def finish(project: Project) -> None:
    """The command of a user, and the one line that is said where a killed run has left its lock."""
    done = project.snakemake("--cores", "1", *JOB)
    if done.returncode and "--unlock" in done.stdout:
        project.snakemake("--unlock", *CONFIG)
        done = project.snakemake("--cores", "1", *JOB)
    assert done.returncode == 0, done.stdout


def kill_after(project: Project, seconds: float) -> bool:
    """Start the job and kill all of it after a time; whether it was still running then."""
    environment = os.environ | {"PYTHONPATH": str(project.folder / "src"), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "snakemake", "--cores", "1", *JOB]
    project.snakemake("--unlock", *CONFIG)
    with subprocess.Popen(
        command,
        cwd=project.folder,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # the session is the job: nothing else is killed
    ) as job:
        try:
            job.wait(timeout=seconds)
            return False
        except subprocess.TimeoutExpired:
            os.killpg(job.pid, signal.SIGKILL)
            return True


def attack_with_kills(folder: Path, kills: int) -> None:
    whole = fresh(folder / "whole")
    began = time.monotonic()
    finish(whole)
    expected, lasts = results(whole), time.monotonic() - began
    project = fresh(folder / "killed")
    moments, rounds, killed = random.Random(0), 0, 0
    while killed < kills:
        shutil.rmtree(project.folder / "results", ignore_errors=True)
        while killed < kills and kill_after(project, moments.uniform(0.0, 0.7 * lasts)):
            killed += 1
        finish(project)
        rounds += 1
        assert results(project) == expected, f"after {killed} kills"
        left = [p for p in (project.folder / "results").rglob("*.tmp")]
        assert all(path.name.startswith(".") for path in left), left
        print(f"{killed} of {kills} kills, finished {rounds} times: all results the same", flush=True)


def measured(project: Project, *arguments: str) -> tuple[float, float, subprocess.CompletedProcess[str]]:
    """Seconds of one core, largest memory [MB] of any process that ended so far, and what was said."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = project.snakemake(*arguments)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return spent, after.ru_maxrss / 1024, done


def attack_with_load(folder: Path) -> None:
    project = fresh(folder / "load")
    rows = "\n".join(f"s{i},data/bench_elbow/*.csv,trial3" for i in range(SUBJECTS))
    (project.folder / "subjects.csv").write_text(f"subject,files,test\n{rows}\n")
    project.lay_over({"data": {"subjects": "subjects.csv"}, "targets": {"datasets": ["subjects"], "scales": [1]}})
    seconds, peak, done = measured(project, "-n", "--quiet", *CONFIG, "--", "results/summary.csv", "results/index.html")
    assert done.returncode == 0, done.stdout[-3000:]
    print(f"{SUBJECTS} subjects planned in {seconds:.0f} s of one core with {peak:.0f} MB")
    assert seconds < PLAN_S and peak < PLAN_MB

    time_s = 0.01 * np.arange(SAMPLES)
    for name in ("long1", "long2"):
        phase = 1.0 + 0.01 * len(name) * np.sin(0.7 * time_s) + (name == "long2")
        columns = {"emg_biceps": 0.3 + 0.2 * np.sin(phase * time_s), "emg_triceps": 0.2 + 0.1 * np.cos(phase * time_s)}
        table = pd.DataFrame({"time_s": time_s, **columns, "angle_rad": 0.5 + 0.4 * np.sin(0.9 * phase * time_s)})
        table.round(6).to_csv(project.folder / f"{name}.csv", index=False)
    dataset = {"kind": "measured", "files": ["long*.csv"], "test": ["long2"], "identify": {"f0_Bi": {}}}
    project.lay_over({"data": {"datasets": {"long": dataset}}, "targets": {"datasets": ["long"], "follow_verdict": []}})
    seconds, peak, done = measured(project, "--cores", "1", "results/data/long/scales.parquet", *CONFIG)
    assert done.returncode == 0, done.stdout[-3000:]
    print(f"two trials of {SAMPLES} samples imported and split in {seconds:.0f} s of one core; at most {peak:.0f} MB")
    assert seconds < IMPORT_S and peak < max(IMPORT_MB, PLAN_MB)


@contextmanager
def small_disk(place: Path) -> Iterator[None]:
    """A disk of its own under a folder."""
    place.mkdir(parents=True, exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={DISK_KB}k", "tmpfs", str(place)], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def attack_the_disk(folder: Path) -> None:
    if os.geteuid() != 0:
        print("disk: left out, as only root can mount a small disk")
        return
    project = fresh(folder / "disk")
    place = project.folder / "results"
    with small_disk(place):
        full = project.snakemake("--cores", "1", *JOB)
        said = [line for line in full.stdout.splitlines() if "No space left on device" in line]
        assert full.returncode != 0 and said, full.stdout[-3000:]
        print(f"full disk: {said[0][:160]}")
        remount = ["mount", "-o", "remount", str(place)]
        subprocess.run([*remount[:2], "remount,ro", str(place)], check=True)
        closed = project.snakemake("--cores", "1", *JOB)
        assert closed.returncode != 0 and "results cannot be written" in closed.stdout, closed.stdout[-3000:]
        assert "Traceback" not in closed.stdout
        print("read-only disk: said, nothing run")
        subprocess.run([*remount[:2], "remount,rw,size=200m", str(place)], check=True)
        finish(project)
        assert len(results(project)) == 3
        print("with room again: finished")


def main(chosen: list[str]) -> None:
    kills = next((int(word.partition("=")[2]) for word in chosen if word.startswith("kills=")), 40)
    wanted = {word.partition("=")[0] for word in chosen} or {"kills", "load", "disk"}
    with tempfile.TemporaryDirectory() as folder:
        for name, attack in (("disk", attack_the_disk), ("load", attack_with_load)):
            if name in wanted:
                attack(Path(folder))
        if "kills" in wanted:
            attack_with_kills(Path(folder), kills)


if __name__ == "__main__":
    main(sys.argv[1:])
