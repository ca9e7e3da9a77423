"""MLflow shows the results: the only module that imports it.

The store is a projection of the files in results/ and can be made again at any time. `publish` writes it, one process
at a time, so that no two ever open a fresh sqlite file at once. Each run carries a tag `job_key`, what it stands for,
and `content`, a digest of the files it was made from: unchanged runs stay, changed ones are replaced.

What runs hold is decided in `contents`, and how an experiment looks when it is opened in `views`.
"""

import fcntl
import itertools
import json
import logging
import os
import re
import sqlite3
import sys
import tempfile
import urllib.request
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any
from urllib.error import HTTPError, URLError

import pandas as pd

from myowave.settings.section import without_passwords
from myowave.tracking.contents import EXPERIMENTS, LEARNING, RunContent, RunGroup
from myowave.tracking.views import TABLE, VIEW, views_of

os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")  # read at import
os.environ.setdefault("MLFLOW_SUPPRESS_PRINTING_URL_TO_STDOUT", "true")  # two lines for every run on a server
os.environ.setdefault("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "3")  # 7 of them keep a run waiting for minutes

import mlflow
from mlflow.entities import Metric, Param, Run, RunTag

logging.getLogger("alembic").setLevel(logging.WARNING)  # progress of creating the tables, of no use to a reader
logging.getLogger("mlflow.store.db.utils").setLevel(logging.CRITICAL)  # likewise, and tracebacks of what notes say

SQLITE = "sqlite:///"
APP = "myowave"  # of MLflow's server, see `browser_app`
# What its pages keep in the browser: the way of work they show, and that the assistant need not open by itself.
_KEPT = {"mlflow.workflowType_v1": '"machine_learning"', "mlflow.assistant.fab.autoOpenedOnFirstLoad_v1": "true"}
_MAGIC, _ENDINGS = b"SQLite format 3\0", ("", "-journal", "-wal", "-shm")
_ANSWER_S = 10.0  # a server that needs longer to say that it is there is not there
_BATCH = 1000  # MLflow's limit for metrics in one call
_PARAM_LENGTH = 500  # MLflow's limit for the text of a parameter is higher; longer ones cannot be read in a table


def publish(groups: Iterable[RunGroup], uri: str, *, needed: bool = False) -> str:
    """Project results into the MLflow store and say what was done.

    Results never depend on MLflow: where it fails, the returned note says why.

    Args:
        groups: what to show.
        uri: `tracking.uri` of the settings.
        needed: whether a failure is an error, as where nothing else was asked for.

    Returns:
        A note in Markdown.

    Raises:
        ValueError: with the note, if it was needed and failed.
    """
    groups = list(groups)
    try:
        if is_server(uri):
            _knock(uri)
        with _only_writer(uri):
            aside = _make_whole(_file_of(uri)) if uri.startswith(SQLITE) else ""
            written, kept = _publish(groups, uri)
    except Exception as error:  # whatever a store or a server may raise; training must not fail because of it
        ours = isinstance(error, ConnectionError | ValueError)
        what = error if ours else f"MLflow failed: {type(error).__name__}: {error}"
        note = without_passwords(
            f"**Not published** to tracking.uri = {uri}. {what}\n\n"
            "The results are complete without it; `snakemake --cores 1 publish` shows them later.\n"
        )
        if needed:
            raise ValueError(note) from None
        return note
    where = f"at {uri}{start_page(uri)}" if is_server(uri) else "with `make ui`"
    return without_passwords(f"{aside}{written} runs written to {uri}, {kept} there already. Browse them {where}\n")


def is_server(uri: str) -> bool:
    """Whether the store is a server, rather than a file or database."""
    return uri.startswith(("http://", "https://"))


def serve(uri: str, port: int = 5000) -> None:
    """Replace this process by the MLflow UI, reachable from this machine only.

    Raises:
        ValueError: if there is no store yet, or none that can be opened.
    """
    if is_server(uri):
        raise ValueError(f"tracking.uri is the server {uri}; open that address in a browser.")
    if uri.startswith(SQLITE) and not _file_of(uri).exists():
        raise ValueError(
            f"There is no MLflow store at {_file_of(uri)} yet; it is made by `make run`, or from existing results by "
            "`snakemake --cores 1 publish`."
        )
    try:
        why = _why_closed(_file_of(uri)) if uri.startswith(SQLITE) else ""
        page = "" if why else start_page(uri)
    except Exception as error:  # whatever a database that is down may raise
        why = str(error) if isinstance(error, ValueError) else _in_short(error)
    if why:
        raise ValueError(
            without_passwords(f"The MLflow store at {uri} cannot be opened ({why}).")
            + " `snakemake --cores 1 publish` puts a damaged file aside and makes it anew from results/."
        )
    print(f"Results in the browser: http://127.0.0.1:{port}{page} (stop with Ctrl-C)", flush=True)
    os.environ["MLFLOW_SERVER_ENABLE_JOB_EXECUTION"] = "false"  # starts in half the time
    command = ["mlflow", "ui", "--backend-store-uri", uri, "--host", "127.0.0.1", "--port", str(port), "--workers", "1"]
    if entry_points(group="mlflow.app", name=APP):  # known once this version is installed
        command += ["--app-name", APP]
    os.execv(sys.executable, [sys.executable, "-m", *command])


def start_page(uri: str) -> str:
    """Path of the page to open first: the learning experiment in its prepared view, where it is there."""
    found = mlflow.MlflowClient(tracking_uri=uri).get_experiment_by_name(LEARNING)
    return f"/{_prepared_view(found.experiment_id)}" if found else ""


def _prepared_view(experiment: str, view: str = VIEW, mode: str = "CHART") -> str:
    more = f"&compareRunsMode={mode}&workflowType=machine_learning"
    return f"#/experiments/{experiment}/runs?viewStateShareKey={view}{more}"


def browser_app() -> Any:
    """MLflow's server with a first page that opens experiments as those of machine learning.

    Its pages keep in the browser which of two ways of work they show, and begin with that of language models, whatever
    an experiment says of itself: a click on one in the list then leads to an empty page of traces instead of its runs.
    `mlflow.app` in pyproject.toml names this function.
    """
    from fastapi.responses import HTMLResponse
    from fastapi.routing import APIRoute
    from mlflow.server import app as pages
    from mlflow.server.fastapi_app import app

    keep = "".join(f"localStorage.setItem({json.dumps(key)}, {json.dumps(value)});" for key, value in _KEPT.items())
    page = Path(pages.static_folder, "index.html").read_text(encoding="utf-8")
    page = page.replace("<head>", f"<head><script>{keep}</script>", 1)
    app.router.routes.insert(0, APIRoute("/", lambda: HTMLResponse(page)))
    return app


def _publish(groups: Iterable[RunGroup], uri: str) -> tuple[int, int]:
    """Numbers of runs written and of runs that were there already."""
    client = mlflow.MlflowClient(tracking_uri=uri)
    experiments: dict[str, tuple[str, dict[str, list[Run]]]] = {}
    written = kept = 0
    for group in groups:
        if group.experiment not in experiments:
            found = _experiment(client, group.experiment, uri)
            _describe(client, found, group.experiment)
            experiments[group.experiment] = found, _runs_by_key(client, found)
        experiment, there = experiments[group.experiment]
        expected = [group.parent, *group.children]
        if all(_is_current(there.get(run.job_key, []), group.digest) for run in expected):
            kept += len(expected)
            continue
        for run in _below(there, group.parent.job_key):
            client.delete_run(run.info.run_id)
        tags = {"content": group.digest}
        parent_id = _write(client, experiment, group.parent, tags)
        for child in group.children:
            _write(client, experiment, child, tags | {"mlflow.parentRunId": parent_id})
        written += len(expected)
    if experiments and not is_server(uri):
        _hide_default(client)
    return written, kept


def _knock(uri: str) -> None:
    """Whether a server answers, whatever it says.

    Raises:
        ConnectionError: if it does not; MLflow itself would try for a minute, and then say it in 30 lines.
    """
    try:
        urllib.request.urlopen(f"{uri.rstrip('/')}/health", timeout=_ANSWER_S).close()
    except HTTPError:  # it answers; whether it lets us in, MLflow finds out
        return
    except (URLError, OSError) as error:
        raise ConnectionError(
            f"No server answers there ({getattr(error, 'reason', error)}): start it, or correct the address."
        ) from None


@contextmanager
def _only_writer(uri: str) -> Iterator[None]:
    """Wait until no other process of this machine writes the sqlite store; make its folder."""
    if not uri.startswith(SQLITE):
        yield
        return
    path = _file_of(uri)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.with_name(path.name + ".lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print(f"Waiting for another process that writes {path} ...", file=sys.stderr, flush=True)
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _make_whole(path: Path) -> str:
    """Make a sqlite store where there is none, in one step; one that cannot be opened is put aside first.

    MLflow needs seconds to make its tables, and never opens a file again in which it was killed meanwhile.

    Returns:
        What was put aside, for people; empty where nothing was.

    Raises:
        ValueError: for a file that is no database: it may be anything.
    """
    if path.exists() and path.stat().st_size == 0:
        path.unlink()
    aside = ""
    if path.exists() and (why := _why_closed(path)):
        number = next(n for n in itertools.count(1) if not path.with_name(f"{path.name}.damaged-{n}").exists())
        kept = path.with_name(f"{path.name}.damaged-{number}")
        for ending in _ENDINGS:  # a journal that stays would be played back into the new file
            if (part := path.with_name(path.name + ending)).exists():
                part.rename(kept.with_name(kept.name + ending))
        aside = f"{path} could not be opened ({why}); it is now {kept.name}, and was made anew. "
    if not path.exists():
        draft = path.with_name(f".{path.name}.draft")
        for ending in _ENDINGS:
            draft.with_name(draft.name + ending).unlink(missing_ok=True)
        mlflow.MlflowClient(tracking_uri=f"{SQLITE}{draft}").search_experiments(max_results=1)
        draft.replace(path)
    return aside


def _why_closed(path: Path) -> str:
    """Why a sqlite file is no store that MLflow can open; empty where it can."""
    with path.open("rb") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            raise ValueError(f"{path} is no SQLite database. Name another file, or remove it.")
    try:
        with closing(sqlite3.connect(path)) as database:
            if (found := database.execute("PRAGMA quick_check(1)").fetchone()[0]) != "ok":
                return " ".join(str(found).split())[:200]
        # Through a link, as MLflow keeps open what it once opened by its address, also where another file is there now.
        with tempfile.TemporaryDirectory() as folder:
            (link := Path(folder, path.name)).symlink_to(path.resolve())
            mlflow.MlflowClient(tracking_uri=f"{SQLITE}{link}").search_experiments(max_results=1)
    except Exception as error:
        if re.search("is locked|readonly database|unable to open|disk is full|I/O error", str(error)):  # no damage
            raise
        return _in_short(error)
    return ""


def _in_short(error: Exception) -> str:
    return f"{type(error).__name__}: {str(error).strip().partition(chr(10))[0][:200]}"


def _file_of(uri: str) -> Path:
    """The file of a sqlite store."""
    return Path(uri.removeprefix(SQLITE))


def _below(there: Mapping[str, list[Run]], job_key: str) -> Iterator[Run]:
    """Runs that stand for a job or a part of it, such as a seed."""
    for key, runs in there.items():
        if key == job_key or key.startswith(job_key + "/"):
            yield from runs


def _experiment(client: mlflow.MlflowClient, name: str, uri: str) -> str:
    """Id of an experiment, made where it is not there; only a server decides for itself where artifacts lie.

    A file store keeps absolute paths of its artifacts and nothing can change them. Where it was moved, the old
    experiment is put away and a new one takes its name.
    """
    location = None if is_server(uri) else _artifact_folder(name, uri).as_uri()
    found = client.get_experiment_by_name(name)
    if found is not None and location not in (None, found.artifact_location):
        client.rename_experiment(found.experiment_id, f"{name} (moved, {found.experiment_id})")
        client.delete_experiment(found.experiment_id)
        found = None
    if found is not None:
        if found.lifecycle_stage == "deleted":
            client.restore_experiment(found.experiment_id)
        return found.experiment_id
    return client.create_experiment(name, artifact_location=location)


def _describe(client: mlflow.MlflowClient, experiment: str, name: str) -> None:
    """Say what an experiment holds, prepare its views, and link to the first of them."""
    tags = {f"mlflow.sharedViewState.{key}": json.dumps(view) for key, view in views_of(name).items()}
    shown = []
    if VIEW in (views := views_of(name)):
        table = TABLE if TABLE in views else VIEW
        shown = [
            f"[{text}]({_prepared_view(experiment, view, mode)})"
            for text, view, mode in (("Charts", VIEW, "CHART"), ("Table", table, "TABLE"))
        ]
    tags |= {"mlflow.note.content": " ".join([EXPERIMENTS[name], *shown])}
    tags |= {"mlflow.experimentKind": "custom_model_development"}
    for key, value in tags.items():
        client.set_experiment_tag(experiment, key, value)


def _hide_default(client: mlflow.MlflowClient) -> None:
    """Take MLflow's own empty experiment out of the list."""
    default = client.get_experiment("0")
    if default.lifecycle_stage == "active" and not client.search_runs(["0"], max_results=1):
        client.delete_experiment("0")


def _artifact_folder(name: str, uri: str) -> Path:
    """Where artifacts of an experiment lie: beside a sqlite file, or in results/ where the store is a database."""
    beside = _file_of(uri).parent if uri.startswith(SQLITE) else Path("results")
    return beside.resolve() / "mlartifacts" / re.sub(r"\W+", "-", name).strip("-")


def _runs_by_key(client: mlflow.MlflowClient, experiment: str) -> dict[str, list[Run]]:
    runs: dict[str, list[Run]] = {}
    token = None
    while True:
        page = client.search_runs([experiment], max_results=1000, page_token=token)
        for run in page:
            runs.setdefault(run.data.tags.get("job_key", ""), []).append(run)
        token = page.token
        if not token:
            return runs


def _is_current(runs: list[Run], content: str) -> bool:
    return len(runs) == 1 and runs[0].data.tags.get("content") == content and runs[0].info.status == "FINISHED"


def _write(client: mlflow.MlflowClient, experiment: str, content: RunContent, tags: Mapping[str, str]) -> str:
    """Write one run; its state is FINISHED only when all of it is there."""
    started = content.finished - content.duration_s
    run_id = client.create_run(experiment, start_time=round(1000 * started), run_name=content.name).info.run_id
    all_tags = {**content.tags, **tags, "job_key": content.job_key, "mlflow.note.content": content.description}
    client.log_batch(
        run_id,
        params=[Param(k, str(v)[:_PARAM_LENGTH]) for k, v in content.params.items()],
        tags=[RunTag(k, str(v)) for k, v in all_tags.items()],
    )
    metrics = list(_metrics(content))
    for start in range(0, len(metrics), _BATCH):
        client.log_batch(run_id, metrics=metrics[start : start + _BATCH])
    for path in content.artifacts:
        client.log_artifact(run_id, str(path))
    client.set_terminated(run_id, end_time=round(1000 * content.finished))
    return run_id


def _metrics(content: RunContent) -> Iterator[Metric]:
    """Final values and curves; values that are not there are left out."""
    for name, value in content.metrics.items():
        if pd.notna(value):
            yield Metric(name, float(value), 0, 0)
    for name, curve in content.curves.items():
        for epoch, value in curve.dropna().items():
            yield Metric(name, float(value), 0, int(epoch))
