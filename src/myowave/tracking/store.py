"""MLflow shows the results: the only module that imports it.

The store is a projection of the files in results/: delete it and publish again at any time. `publish` writes it, one
process at a time, so that no two ever open a fresh sqlite file at once. Each run carries a tag `key`, what it stands
for, and `content`, a digest of what its dataset shows: unchanged runs stay, changed ones are replaced, and one whose
files are no longer there is kept. What runs hold is decided in `contents`.
"""

import fcntl
import json
import logging
import os
import shutil
import socket
import sqlite3
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path

import pandas as pd

from myowave.settings.section import without_secrets
from myowave.tracking.contents import RunContent, digest

os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")  # read at import
os.environ.setdefault("MLFLOW_SUPPRESS_PRINTING_URL_TO_STDOUT", "true")  # two lines for every run on a server
os.environ.setdefault("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "1")  # 7 of them keep a run waiting for minutes

import mlflow
from mlflow.entities import Metric, Param, Run
from mlflow.store.artifact.local_artifact_repo import LocalArtifactRepository

logging.getLogger("alembic").setLevel(logging.WARNING)  # progress of creating the tables, of no use to a reader
logging.getLogger("mlflow.store.db.utils").setLevel(logging.CRITICAL)  # likewise, and tracebacks of what notes say

EXPERIMENT = "myowave"
_NAME = "attributes.`Run Name`"
# Few columns of the first page, before the duration, so that a laptop shows recipes beside scores.
_COLUMNS = [f"metrics.`{name}`" for name in ("test_r2", "test_rmse_deg")]
_COLUMNS += [f"params.`{name}`" for name in ("recipe", "scales", "verdict")]
_TABLE = {"selectedColumns": _COLUMNS, "columnOrder": [_NAME, *_COLUMNS], "columnWidths": {_NAME: 300}}
_BATCH, _ALL = 1000, 50_000  # MLflow's limits for metrics in one call, and for runs in one answer
_AGAIN = "delete it and publish again: `snakemake --cores 1 publish` makes it of the files in results/"


def publish(datasets: Iterable[tuple[RunContent, ...]], uri: str, *, needed: bool = False) -> str:
    """Project results, of each dataset first its own run, into the MLflow store, and say what was done.

    Results never depend on MLflow: a failure is a ValueError only where publishing is `needed`, else it is said.
    """
    try:
        with _only_writer(uri):
            done = _publish(datasets, uri)
            browse = "with `make ui`" if _file_of(uri) else f"at {uri}{start_page(uri)}"
    except Exception as error:  # whatever a store or a server may raise; training must not fail because of it
        note = without_secrets(
            f"**Not published** to tracking.uri = {uri}. {_reason(error, uri)}\n\n"
            "The results are complete without it; `snakemake --cores 1 publish` shows them later.\n"
        )
        if needed:
            raise ValueError(note) from None
        return note
    lost = f", {done['lost']} whose files are gone kept as they are" if done["lost"] else ""
    return without_secrets(
        f"{done['written']} runs written to {uri}, {done['replaced']} of them in place of older ones, {done['kept']} "
        f"there already{lost}. Browse them {browse}\n"
    )


def serve(uri: str, port: int = 5000) -> None:
    """Replace this process by the MLflow UI, reachable from this machine only; a ValueError where it shows nothing."""
    path = _file_of(uri)
    if path is None:
        raise ValueError(without_secrets(f"tracking.uri is the server {uri}; open that address in a browser."))
    if not path.exists():
        make = "`make run`, or from existing results by `snakemake --cores 1 publish`"
        raise ValueError(f"There is no MLflow store at {path} yet; it is made by {make}.")
    try:
        _check(path)
        page = start_page(uri)
    except Exception as error:  # whatever a store may raise
        raise ValueError(without_secrets(f"{uri} cannot be shown. {_reason(error, uri)}")) from None
    with socket.socket() as probe:
        if not probe.connect_ex(("127.0.0.1", port)):
            raise ValueError(f"Port {port} is in use already; `myowave ui --port {port + 1}` takes another.")
    print(f"Results in the browser: http://127.0.0.1:{port}{page} (stop with Ctrl-C)", flush=True)
    os.environ["MLFLOW_SERVER_ENABLE_JOB_EXECUTION"] = "false"  # starts in half the time
    where = ["--backend-store-uri", uri, "--artifacts-destination", str(_artifacts(path).resolve())]
    command = ["mlflow", "ui", *where, "--host", "127.0.0.1", "--port", str(port), "--workers", "1"]
    os.execv(sys.executable, [sys.executable, "-m", *command])


def start_page(uri: str) -> str:
    """Path of the page to open first: the table of runs."""
    found = mlflow.MlflowClient(tracking_uri=uri).get_experiment_by_name(EXPERIMENT)
    more = "compareRunsMode=TABLE&workflowType=machine_learning&viewStateShareKey=table"
    return f"/#/experiments/{found.experiment_id}/runs?{more}" if found else ""


def _publish(datasets: Iterable[tuple[RunContent, ...]], uri: str) -> Counter[str]:
    """Numbers of runs written, replaced and kept, and of those there whose files are gone."""
    client, path = mlflow.MlflowClient(tracking_uri=uri), _file_of(uri)
    experiment = _experiment(client, path)
    there: dict[str, list[Run]] = {}
    for run in client.search_runs([experiment], max_results=_ALL):
        if run.info.status == "RUNNING" and path:  # only one writes a file at a time: it was killed
            client.set_terminated(run.info.run_id, "KILLED")
        there.setdefault(run.data.tags.get("key", ""), []).append(run)
    done: Counter[str] = Counter()
    for runs in datasets:
        tags = {"content": digest(runs)}
        before = [run for content in runs for run in there.pop(content.key, [])]
        found = [(run.data.tags["key"], run.data.tags.get("content"), run.info.status) for run in before]
        if found == [(run.key, tags["content"], "FINISHED") for run in runs]:
            done["kept"] += len(runs)
            continue
        for run in before:
            client.delete_run(run.info.run_id)
            if path:
                shutil.rmtree(_artifacts(path, run).parent, ignore_errors=True)
            done["replaced"] += 1
        for content in runs:
            run_id = _write(client, experiment, content, tags, path)
            tags.setdefault("mlflow.parentRunId", run_id)  # of the first, which is that of the dataset
            done["written"] += 1
    done["lost"] = sum(map(len, there.values()))
    return done


def _write(
    client: mlflow.MlflowClient, experiment: str, content: RunContent, tags: Mapping[str, str], path: Path | None
) -> str:
    """Write one run; its state is FINISHED only when all of it is there."""
    tags = {**tags, "key": content.key, "mlflow.note.content": content.description}
    started = round(1000 * (content.finished - content.duration_s))
    run = client.create_run(experiment, start_time=started, tags=tags, run_name=content.name)
    run_id, state = run.info.run_id, "FAILED"
    local = LocalArtifactRepository(str(_artifacts(path, run))) if path else None
    keep = local.log_artifact if local else partial(client.log_artifact, run_id)
    try:
        client.log_batch(run_id, params=[Param(k, str(v)) for k, v in content.params.items()])
        metrics = [Metric(k, float(v), 0, 0) for k, v in content.metrics.items() if pd.notna(v)]
        curves = [(k, curve.dropna()) for k, curve in content.curves.items()]
        metrics += [Metric(k, float(v), 0, int(epoch)) for k, curve in curves for epoch, v in curve.items()]
        for start in range(0, len(metrics), _BATCH):
            client.log_batch(run_id, metrics=metrics[start : start + _BATCH])
        for name, file in content.artifacts.items():
            keep(str(file), name.rpartition("/")[0] or None)
        state = "FINISHED"
    finally:
        client.set_terminated(run_id, state, end_time=round(1000 * content.finished))
    return run_id


def _experiment(client: mlflow.MlflowClient, path: Path | None) -> str:
    """Id of the experiment, made where it is not there, with the columns that its table begins with."""
    found = client.get_experiment_by_name(EXPERIMENT)
    if found is not None and found.lifecycle_stage == "deleted":
        client.restore_experiment(found.experiment_id)
    where = f"mlflow-artifacts:/{EXPERIMENT}" if path else None  # below the folder that `serve` names
    experiment = found.experiment_id if found else client.create_experiment(EXPERIMENT, artifact_location=where)
    client.set_experiment_tag(experiment, "mlflow.experimentKind", "custom_model_development")
    client.set_experiment_tag(experiment, "mlflow.sharedViewState.table", json.dumps(_TABLE))
    return experiment


def _artifacts(path: Path, run: Run | None = None) -> Path:
    """Where artifacts lie, those of one run or all: beside the sqlite file, so that both can be moved."""
    folder = path.parent / "mlartifacts"
    return folder / EXPERIMENT / run.info.run_id / "artifacts" if run else folder


@contextmanager
def _only_writer(uri: str) -> Iterator[None]:
    """Wait until no other process of this machine writes the sqlite store; make it where there is none.

    MLflow needs seconds to make its tables, and never opens a file in which that was cut off: they are made in a draft.
    """
    if (path := _file_of(uri)) is None:
        yield
        return
    _check(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.with_name(f".{path.name}.publishing").open("a") as lock:  # "w" would empty whatever is called so
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not path.exists():
            draft = path.with_name(f".{path.name}.draft")
            for ending in ("", "-journal"):
                draft.with_name(draft.name + ending).unlink(missing_ok=True)
            mlflow.MlflowClient(tracking_uri=f"sqlite:///{draft}").search_experiments(max_results=1)
            draft.replace(path)
        yield


def _check(path: Path) -> None:
    """Raise a ValueError where a file is there and not MLflow's: it may be anything."""
    if not path.exists():
        return
    if not path.is_file():
        raise ValueError(f"{path} is no file. Name one in tracking.uri.")
    try:
        with closing(sqlite3.connect(path)) as database:
            theirs = database.execute("SELECT 1 FROM sqlite_master WHERE name = 'experiments'").fetchone()
    except sqlite3.DatabaseError as error:
        if isinstance(error, sqlite3.OperationalError):  # in use, or not to be read
            raise
        theirs = None
    if not theirs:
        raise ValueError(f"{path} is no MLflow store. Name another file in tracking.uri; if it was one, {_AGAIN}.")


def _reason(error: Exception, uri: str) -> str:
    if isinstance(error, ValueError):
        return str(error)
    what = f"{type(error).__name__}: {str(error).strip().partition(chr(10))[0][:200]}"
    return f"{what}. " + (f"If damaged, {_AGAIN}." if _file_of(uri) else "Start the server, or correct the address.")


def _file_of(uri: str) -> Path | None:
    """The file of a sqlite store; None where the address is that of a server."""
    return None if uri.startswith(("http://", "https://")) else Path(uri.removeprefix("sqlite:///"))
