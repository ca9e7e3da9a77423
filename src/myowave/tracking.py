"""MLflow shows the results: the only module that imports it.

The store is a projection of the files in results/ and can be made again at any time. `publish` writes it from one
process, so that no two ever open a fresh sqlite file at once. Each run carries a tag `job_key`, what it stands for, and
`content`, a digest of the files it was made from: unchanged runs are left alone, changed ones replaced.

Structure: an experiment for each dataset; in it a parent run for each model, recipe and number of scales, with the
medians over seeds, and below it a run for each seed. In the table children are folded away and charts draw the
parents, so all parameters are on both.
"""

import hashlib
import json
import logging
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from myowave.data.store import read_table

os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")  # read at import

import mlflow
from mlflow.entities import Metric, Param, Run, RunTag

for _name in ("alembic", "mlflow.store.db.utils"):  # progress of creating the tables, of no use to a reader
    logging.getLogger(_name).setLevel(logging.WARNING)

SQLITE = "sqlite:///"
COORDINATES = ("dataset", "model", "recipe", "scales")
CURVE_POINTS = 60  # a curve in the browser needs no more
_BATCH = 1000  # MLflow's limit for metrics in one call


@dataclass(frozen=True)
class TrainedModel:
    """The files of one model trained at some number of scales, all seeds.

    Args:
        folder: holds evaluation.csv and the histories of the scales.
        settings: the recipe it was trained with.
        figures: pictures to attach.
    """

    folder: Path
    settings: Mapping[str, Any]
    figures: tuple[Path, ...] = ()


@dataclass(frozen=True)
class _RunContent:
    """What goes into one MLflow run."""

    name: str
    job_key: str
    params: Mapping[str, Any]
    metrics: Mapping[str, float]
    curves: pd.DataFrame  # indexed by epoch over all scales
    description: str
    tags: Mapping[str, str]
    artifacts: tuple[Path, ...] = ()


def publish(models: Iterable[TrainedModel], uri: str) -> str:
    """Project trained models into the MLflow store and say what was done.

    Results never depend on MLflow: where it fails, the returned note says why, and nothing is raised.

    Args:
        models: what to show.
        uri: `tracking.uri` of the settings.

    Returns:
        A note in Markdown.
    """
    try:
        written, kept = _publish(models, uri)
    except Exception as error:  # whatever a store or a server may raise; training must not fail because of it
        return (
            f"**Not published.** MLflow at {uri} failed: {type(error).__name__}: {error}\n\n"
            "The results are complete without it. Try again with `snakemake --cores 1 publish`.\n"
        )
    return f"{written} runs written to {uri}, {kept} there already. Browse them with `make ui`.\n"


def serve(uri: str, port: int = 5000) -> None:
    """Replace this process by the MLflow UI, reachable from this machine only.

    Raises:
        ValueError: if there is no store yet.
    """
    if uri.startswith(SQLITE) and not Path(uri.removeprefix(SQLITE)).exists():
        raise ValueError(
            f"There is no MLflow store at {uri.removeprefix(SQLITE)} yet; it is made by `make run`, or from existing "
            "results by `snakemake --cores 1 publish`."
        )
    if uri.startswith("http"):
        raise ValueError(f"tracking.uri is the server {uri}; open that address in a browser.")
    os.environ["MLFLOW_SERVER_ENABLE_JOB_EXECUTION"] = "false"  # starts in half the time
    print(f"Results in the browser: http://127.0.0.1:{port} (stop with Ctrl-C)", flush=True)
    command = ["mlflow", "ui", "--backend-store-uri", uri, "--host", "127.0.0.1", "--port", str(port), "--workers", "1"]
    os.execv(sys.executable, [sys.executable, "-m", *command])


def _publish(models: Iterable[TrainedModel], uri: str) -> tuple[int, int]:
    """Numbers of runs written and of runs that were there already."""
    client = mlflow.MlflowClient(tracking_uri=_prepared(uri))
    written = kept = 0
    for model in models:
        content = _digest(model)
        parent, children = _contents(model)
        experiment = _experiment(client, f"learning: {parent.params['dataset']}", uri)
        there = _runs_by_key(client, experiment)
        expected = [parent, *children]
        if all(_is_current(there.get(run.job_key, []), content) for run in expected):
            kept += len(expected)
            continue
        for run in _below(there, parent.job_key):
            client.delete_run(run.info.run_id)
        tags = {"content": content}
        parent_id = _write(client, experiment, parent, tags)
        for child in children:
            _write(client, experiment, child, tags | {"mlflow.parentRunId": parent_id})
        written += len(expected)
    return written, kept


def _below(there: Mapping[str, list[Run]], job_key: str) -> Iterator[Run]:
    """Runs that stand for a job or a part of it, such as a seed."""
    for key, runs in there.items():
        if key == job_key or key.startswith(job_key + "/"):
            yield from runs


def _contents(model: TrainedModel) -> tuple[_RunContent, list[_RunContent]]:
    """The parent run, with medians over the seeds, and a run for each seed."""
    table = pd.read_csv(model.folder / "evaluation.csv")
    curves = _curves(model.folder)
    where = {name: table[name].iloc[0] for name in COORDINATES}
    name = "{dataset} {model} {recipe} {scales}-scale".format(**where)
    job_key = "learning/{dataset}/{model}/{recipe}/{scales}-scale".format(**where)
    params = {**where, **model.settings, "seeds": len(table)}
    tags = {k: str(v) for k, v in where.items()}
    metrics = table.drop(columns=[*COORDINATES, "seed"]).select_dtypes("number")
    described = f"{where['model']} on {where['dataset']}, recipe {where['recipe']}, {where['scales']} scale(s)"
    scores = _markdown(metrics.agg(["median", "std"]).T)
    parent = _RunContent(
        name=name,
        job_key=job_key,
        params=params,
        metrics=metrics.median().to_dict() | metrics.std().add_suffix("_std").to_dict(),
        curves=curves.drop(columns="seed").groupby(level="epoch").median(),
        description=f"{described}: medians over {len(table)} seeds, which are the runs below.\n\n"
        f"Made by `snakemake --cores 2 {model.folder}/evaluation.csv`.\n\n{scores}",
        tags=tags | {"kind": "median over seeds"},
        artifacts=(model.folder / "evaluation.csv", *model.figures),
    )
    children = [
        _RunContent(
            name=f"{name} seed {seed}",
            job_key=f"{job_key}/seed-{seed}",
            params=params | {"seed": seed},
            metrics=metrics.loc[row].to_dict(),
            curves=curves[curves["seed"] == seed].drop(columns="seed"),
            description=f"{described}, seed {seed}.",
            tags=tags | {"kind": "seed"},
        )
        for row, seed in table["seed"].items()
    ]
    return parent, children


def _curves(folder: Path) -> pd.DataFrame:
    """Histories of all scales, coarsest first, thinned out; indexed by the epoch over all scales."""
    parts, done = [], 0
    levels = sorted(folder.glob("history-*.parquet"), key=lambda p: -int(p.stem.removeprefix("history-")))
    for path in levels:
        history, _ = read_table(path)
        history["epoch"] += done
        done = history["epoch"].max()
        parts.append(history)
    history = pd.concat(parts).select_dtypes("number")
    epochs = history["epoch"].drop_duplicates()
    shown = epochs.iloc[:: max(1, len(epochs) // CURVE_POINTS)]
    return history[history["epoch"].isin([*shown, done])].set_index("epoch")


def _markdown(table: pd.DataFrame) -> str:
    rows = [f"| {name} | " + " | ".join(f"{v:.4g}" for v in row) + " |" for name, row in table.iterrows()]
    head = f"| | {' | '.join(map(str, table.columns))} |\n|---|{'---|' * len(table.columns)}"
    return "\n".join([head, *rows])


def _digest(model: TrainedModel) -> str:
    """Digest of everything that a model's runs are made of."""
    digest = hashlib.sha256(json.dumps(dict(model.settings), sort_keys=True).encode())
    files = [model.folder / "evaluation.csv", *sorted(model.folder.glob("history-*.parquet")), *model.figures]
    for path in files:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _prepared(uri: str) -> str:
    """The address, with the folder of a sqlite file there."""
    if uri.startswith(SQLITE):
        Path(uri.removeprefix(SQLITE)).parent.mkdir(parents=True, exist_ok=True)
    return uri


def _experiment(client: mlflow.MlflowClient, name: str, uri: str) -> str:
    """Id of an experiment, made where it is not there; artifacts lie beside a sqlite store."""
    found = client.get_experiment_by_name(name)
    if found is not None:
        if found.lifecycle_stage == "deleted":
            client.restore_experiment(found.experiment_id)
        return found.experiment_id
    location = None
    if uri.startswith(SQLITE):
        location = (Path(uri.removeprefix(SQLITE)).resolve().parent / "mlartifacts" / name.replace(": ", "-")).as_uri()
    return client.create_experiment(name, artifact_location=location)


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


def _write(client: mlflow.MlflowClient, experiment: str, content: _RunContent, tags: Mapping[str, str]) -> str:
    """Write one run; its state is FINISHED only when all of it is there."""
    run_id = client.create_run(experiment, run_name=content.name).info.run_id
    all_tags = {**content.tags, **tags, "job_key": content.job_key, "mlflow.note.content": content.description}
    client.log_batch(
        run_id,
        params=[Param(k, str(v)) for k, v in content.params.items()],
        tags=[RunTag(k, str(v)) for k, v in all_tags.items()],
    )
    metrics = list(_metrics(content))
    for start in range(0, len(metrics), _BATCH):
        client.log_batch(run_id, metrics=metrics[start : start + _BATCH])
    for path in content.artifacts:
        client.log_artifact(run_id, str(path))
    client.set_terminated(run_id)
    return run_id


def _metrics(content: _RunContent) -> Iterator[Metric]:
    """Final values, and curves under `curve/`; values that are not there are left out."""
    for name, value in content.metrics.items():
        if pd.notna(value):
            yield Metric(name, float(value), 0, 0)
    for name, curve in content.curves.items():
        for epoch, value in curve.dropna().items():
            yield Metric(f"curve/{name}", float(value), 0, int(epoch))
