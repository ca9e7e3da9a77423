"""A SLURM of one node on this machine, for as long as a test needs it. Only root can start one."""

import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

CONF = Path("/etc/slurm/slurm.conf")  # jobs look for it here and nowhere else
PROGRAMS = ("munged", "slurmctld", "slurmd", "squeue", "scancel")
TEMPLATE = """
ClusterName=one
SlurmctldHost={host}(127.0.0.1)
AuthType=auth/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmUser=root
SlurmctldPort=16817
SlurmdPort=16818
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ReturnToService=2
MinJobAge=300
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory={memory_mb} State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


def why_not() -> str:
    """Why no SLURM can be started here; empty if one can."""
    missing = [name for name in PROGRAMS if not shutil.which(name, path=os.environ["PATH"] + ":/usr/sbin:/sbin")]
    if missing:
        return f"{', '.join(missing)} not found: apt-get install slurm-wlm munge, as `make test-slurm` does for root"
    if os.getuid() != 0:
        return "only root can start a SLURM"
    if CONF.exists():
        return f"{CONF} is there already; this machine has a SLURM that a test must not disturb"
    return ""


@contextmanager
def one_node(folder: Path) -> Iterator[None]:
    """Start the daemons, wait until the node is idle, and take all away in the end."""
    memory_mb = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**20
    CONF.parent.mkdir(exist_ok=True)
    for name in ("state", "spool"):
        (folder / name).mkdir()
    CONF.write_text(
        TEMPLATE.format(
            host=socket.gethostname().split(".")[0], folder=folder, cpus=os.cpu_count(), memory_mb=memory_mb - 500
        )
    )
    started, said = [], (folder / "daemons.log").open("w")
    options = {"stdout": said, "stderr": said}
    try:
        munge = Path("/run/munge/munged.pid")
        if not munge.exists():
            subprocess.run("mkdir -p /run/munge && chown munge: /run/munge", shell=True, check=True)
            munged = shutil.which("munged", path="/usr/sbin:/sbin")
            started.append(subprocess.Popen([munged, "--foreground"], user="munge", group="munge", **options))
            time.sleep(1)
        for name in ("slurmctld", "slurmd"):
            started.append(subprocess.Popen([shutil.which(name, path="/usr/sbin:/sbin"), "-D"], **options))
        _wait_for("idle")
        yield
    finally:
        subprocess.run(["scancel", "--user", "root"], check=False)
        for process in reversed(started):
            process.terminate()
            process.wait(timeout=30)
        CONF.unlink()
        said.close()


def _wait_for(state: str, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        told = subprocess.run(["sinfo", "-h", "-o", "%T"], capture_output=True, text=True).stdout.strip()
        if told == state:
            return
        time.sleep(0.5)
    raise RuntimeError(f"the node of SLURM is {told!r} after {seconds} s, not {state}; see /etc/slurm/slurm.conf")
