"""A search on a real PostgreSQL server, as workers on many machines share it."""

import os
import pwd
import shutil
import signal
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from sweep_worker import FIRST, SWEEP, start, table_of

from myowave.learning.sweep.search import open_search
from myowave.settings import Sweep

pytestmark = pytest.mark.postgres


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a server that was started for these tests."""
    programs = sorted(Path("/usr/lib/postgresql").glob("*/bin"))
    if not programs and not shutil.which("initdb"):
        pytest.skip("there is no PostgreSQL here: apt-get install postgresql, as `make test-postgres` does for root")
    initdb, server = (str(programs[-1] / name) if programs else name for name in ("initdb", "postgres"))
    folder = tmp_path_factory.mktemp("postgres")
    options = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    if os.getuid() == 0:  # the server refuses to run as root
        options["user"] = owner = "postgres"
        for path in (folder, *folder.parents[:2]):
            path.chmod(path.stat().st_mode | 0o011)
        os.chown(folder, pwd.getpwnam(owner).pw_uid, -1)
    data = folder / "data"
    subprocess.run([initdb, "-D", data, "-U", "me", "--auth=trust"], check=True, cwd=folder, **options)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [server, "-D", data, "-p", str(port), "-h", "127.0.0.1", "-k", str(folder)]
    process = subprocess.Popen(command, cwd=folder, **options)
    try:
        ready = shutil.which("pg_isready") or str(programs[-1] / "pg_isready")
        subprocess.run(
            f"until {ready} -q -h 127.0.0.1 -p {port}; do sleep 0.1; done", shell=True, check=True, timeout=60
        )
        yield f"postgresql://me@127.0.0.1:{port}/postgres"
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(timeout=60)


def test_workers_share_a_server_survive_a_kill_and_go_on(server):
    open_search("test", server, Sweep(**SWEEP), FIRST)
    workers = [start(server, 12, i, pause_s=0.05) for i in range(3)]
    workers[0].stdout.readline()  # it has finished a trial and begins the next
    os.kill(workers[0].pid, signal.SIGKILL)
    for worker in workers:
        worker.communicate(timeout=120)
    assert [worker.returncode for worker in workers] == [-signal.SIGKILL, 0, 0]
    finished = table_of(server, 12).query("state in ('complete', 'pruned')")
    assert len(finished) in (11, 12)  # 11 where the kill cut a trial off

    again = start(server, 12, 0)
    again.communicate(timeout=120)
    table = table_of(server, 12)
    assert table["state"].isin(["complete", "pruned"]).sum() == 12
    assert "running" not in set(table["state"])
    kept = table[table["trial"].isin(finished["trial"])]
    assert kept["error"].fillna(-1).tolist() == finished["error"].fillna(-1).tolist()

    more = start(server, 15, 1)
    more.communicate(timeout=120)
    assert table_of(server, 15)["state"].isin(["complete", "pruned"]).sum() == 15
