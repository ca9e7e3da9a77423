"""MLflow holds what the result files say, once, and its failures stay its own."""

import fcntl
import json
import os
import shutil
import socket
import sqlite3
import subprocess
import sys
import time
import urllib.request
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from threading import Thread

import mlflow
import numpy as np
import pandas as pd
import pytest

from myowave.data.store import write_table
from myowave.tracking.contents import (
    BY_SCALES,
    CURVE_POINTS,
    LEARNING,
    SWEEPS,
    Swept,
    TrainedModel,
    from_model,
    from_sweep,
)
from myowave.tracking.store import publish, serve, start_page

SEEDS = 3
EPOCHS = {1: 150, 0: 250}


@pytest.fixture
def trained(tmp_path):
    """Result files of a model trained at two scales, as the workflow leaves them."""
    folder = tmp_path / "results/learning/case1/base/rollout/2-scale"
    folder.mkdir(parents=True)
    random = np.random.default_rng(0)
    pd.DataFrame(
        {
            "dataset": "case1",
            "model": "base",
            "recipe": "rollout",
            "scales": 2,
            "seed": range(SEEDS),
            "test_mse": random.random(SEEDS),
            "test_r2": random.random(SEEDS),
            "f0_Bi": 300 + random.random(SEEDS),
            "f0_Bi_se": [0.5, 0.6, 0.7],
            "seconds": 12.0,
        }
    ).assign(f0_Bi_error_pct=np.nan).to_csv(folder / "evaluation.csv", index=False)
    pd.DataFrame({"seed": range(SEEDS), "parameter": "f0_Bi", "standard_error": [0.5, 0.6, 0.7]}).to_csv(
        folder / "parameters.csv", index=False
    )
    for level, epochs in EPOCHS.items():
        history = [
            pd.DataFrame({"epoch": np.arange(1, epochs + 1), "seed": seed, "loss": random.random(epochs)})
            for seed in range(SEEDS)
        ]
        write_table(pd.concat(history), folder / f"history-{level}.parquet")
    figure = tmp_path / "results/figures/metrics.png"
    figure.parent.mkdir()
    figure.write_bytes(b"a picture")
    return TrainedModel(folder, {"hidden": 50, "beta": 1e-3}, (figure,))


@pytest.fixture(scope="module")
def empty_store(tmp_path_factory):
    """A sqlite file with MLflow's tables and nothing in it: making them takes seconds."""
    path = tmp_path_factory.mktemp("store") / "mlflow.db"
    publish([], f"sqlite:///{path}")
    mlflow.MlflowClient(tracking_uri=f"sqlite:///{path}").search_experiments()
    return path


@pytest.fixture
def uri(tmp_path, trained, empty_store):
    path = tmp_path / "results/mlflow.db"
    shutil.copy(empty_store, path)
    return f"sqlite:///{path}"


def stored(uri):
    """(client, parent run, runs of the seeds) of the only model in the store."""
    client = mlflow.MlflowClient(tracking_uri=uri)
    experiment = client.get_experiment_by_name(LEARNING)
    runs = client.search_runs([experiment.experiment_id])
    parents = [run for run in runs if "mlflow.parentRunId" not in run.data.tags]
    assert len(parents) == 1
    children = [run for run in runs if run.data.tags.get("mlflow.parentRunId") == parents[0].info.run_id]
    assert len(children) == len(runs) - 1
    return client, parents[0], sorted(children, key=lambda run: int(run.data.params["seed"]))


def test_each_seed_has_a_run_and_the_parent_their_medians(trained, uri):
    publish([from_model(trained)], uri)
    _, parent, children = stored(uri)
    table = pd.read_csv(trained.folder / "evaluation.csv")
    for (_, row), run in zip(table.iterrows(), children, strict=True):
        for name in ("test_mse", "test_r2", "f0_Bi"):
            assert run.data.metrics[name] == pytest.approx(row[name])
    for name in ("test_mse", "test_r2", "f0_Bi"):
        assert parent.data.metrics[name] == pytest.approx(table[name].median())
    assert parent.info.run_name == "case1 base rollout 2-scale"
    assert [run.info.run_name for run in children] == [f"{parent.info.run_name} seed {seed}" for seed in range(SEEDS)]
    assert all(run.data.params.items() >= parent.data.params.items() for run in children)
    assert parent.data.params["hidden"] == "50"


def test_curves_run_through_the_scales_from_the_coarsest(trained, uri):
    publish([from_model(trained)], uri)
    client, _, children = stored(uri)
    curve = client.get_metric_history(children[1].info.run_id, "curve/loss")
    steps = [point.step for point in curve]
    assert steps == sorted(set(steps)) and steps[-1] == sum(EPOCHS.values())
    assert CURVE_POINTS / 2 < len(steps) < 2 * CURVE_POINTS
    coarse = pd.read_parquet(trained.folder / "history-1.parquet").query("seed == 1").set_index("epoch")["loss"]
    assert curve[0].value == pytest.approx(coarse[steps[0]])


def test_tables_and_figures_are_attached(trained, uri):
    publish([from_model(trained)], uri)
    client, parent, _ = stored(uri)
    assert {item.path for item in client.list_artifacts(parent.info.run_id)} == {"evaluation.csv", "metrics.png"}


def test_publishing_again_changes_nothing(trained, uri):
    publish([from_model(trained)], uri)
    before = {run.info.run_id for run in (stored(uri)[1], *stored(uri)[2])}
    note = publish([from_model(trained)], uri)
    assert {run.info.run_id for run in (stored(uri)[1], *stored(uri)[2])} == before
    assert note.startswith("0 runs written")


def test_changed_results_replace_their_runs(trained, uri):
    publish([from_model(trained)], uri)
    path = trained.folder / "evaluation.csv"
    table = pd.read_csv(path)
    table["test_r2"] = 0.123
    table.iloc[:2].to_csv(path, index=False)  # and one seed fewer
    publish([from_model(trained)], uri)
    _, parent, children = stored(uri)
    assert parent.data.metrics["test_r2"] == pytest.approx(0.123) and len(children) == 2


def test_a_run_cut_off_in_the_middle_is_written_again(trained, uri):
    publish([from_model(trained)], uri)
    client, _, children = stored(uri)
    client.update_run(children[0].info.run_id, status="RUNNING")
    publish([from_model(trained)], uri)
    assert [run.info.status for run in stored(uri)[2]] == ["FINISHED"] * SEEDS


def test_a_store_that_fails_is_noted_and_raises_nothing(trained, tmp_path):
    broken = tmp_path / "broken.db"
    broken.write_text("this is no database")
    note = publish([from_model(trained)], f"sqlite:///{broken}")
    assert note.startswith("**Not published**") and "snakemake --cores 1 publish" in note


def test_a_store_is_made_where_there_is_none(trained, tmp_path):
    uri = f"sqlite:///{tmp_path}/new/mlflow.db"
    publish([from_model(trained)], uri)
    assert len(stored(uri)[2]) == SEEDS


def test_a_store_that_was_killed_while_it_was_made_is_not_there_and_the_next_one_is_whole(trained, tmp_path):
    path, draft = tmp_path / "new/mlflow.db", tmp_path / "new/.mlflow.db.draft"
    code = f"from myowave.tracking.store import publish; publish([], 'sqlite:///{path}')"
    with subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL) as making:
        while not (draft.exists() and draft.stat().st_size > 4096):
            assert making.poll() is None and not path.exists()
            time.sleep(0.005)
        making.kill()
    assert draft.exists() and not path.exists(), "it was killed in the middle"
    assert publish([from_model(trained)], f"sqlite:///{path}").startswith(f"{SEEDS + 1} runs written")
    assert len(stored(f"sqlite:///{path}")[2]) == SEEDS and not draft.exists()


def without_half_of_its_tables(path):
    with sqlite3.connect(path) as database:
        for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()[::2]:
            database.execute(f"DROP TABLE IF EXISTS '{name}'")
    database.close()


def with_tables_of_another_version(path):
    with sqlite3.connect(path) as database:
        database.execute("UPDATE alembic_version SET version_num = 'ff01da956556'")
    database.close()


def with_a_page_overwritten(path):
    content = bytearray(path.read_bytes())
    content[4096 : 3 * 4096] = b"\xaa" * 8192
    path.write_bytes(content)


def cut_short(path):
    path.write_bytes(path.read_bytes()[:50_000])
    path.with_name(path.name + "-journal").write_bytes(b"left behind")


DAMAGES = (without_half_of_its_tables, with_tables_of_another_version, with_a_page_overwritten, cut_short)


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_store_that_cannot_be_opened_is_put_aside_and_made_anew(trained, uri, tmp_path, damage):
    path = tmp_path / "results/mlflow.db"
    damage(path)
    with pytest.raises(ValueError, match="cannot be opened.*snakemake --cores 1 publish"):
        serve(uri)
    damaged = path.read_bytes()
    note = publish([from_model(trained)], uri)
    assert f"{path} could not be opened" in note and "is now mlflow.db.damaged-1, and was made anew" in note
    assert len(stored(uri)[2]) == SEEDS and len(note.splitlines()) == 1
    assert (tmp_path / "results/mlflow.db.damaged-1").stat().st_size == len(damaged), "nothing is thrown away"
    assert not (tmp_path / "results/mlflow.db-journal").exists()
    assert publish([from_model(trained)], uri).startswith("0 runs written")


def test_a_store_that_is_in_use_is_never_put_aside(trained, uri, monkeypatch):
    with closing(sqlite3.connect(uri.removeprefix("sqlite:///"))) as other:
        other.execute("BEGIN EXCLUSIVE")
        monkeypatch.setattr(sqlite3, "connect", partial(sqlite3.connect, timeout=0.1))
        note = publish([from_model(trained)], uri)
    assert note.startswith("**Not published**") and "locked" in note
    assert publish([from_model(trained)], uri).startswith(f"{SEEDS + 1} runs written")


def test_waiting_for_another_writer_is_said(trained, uri, capfd):
    with open(f"{uri.removeprefix('sqlite:///')}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        waiting = Thread(target=publish, args=([], uri))
        waiting.start()
        said = ""
        while "Waiting for another process that writes" not in said and waiting.is_alive():
            time.sleep(0.05)
            said += capfd.readouterr().err
        assert waiting.is_alive(), "it waits, and is not silent"
    waiting.join()


def test_a_file_that_is_no_database_is_left_alone(trained, tmp_path):
    mine = tmp_path / "summary.csv"
    mine.write_text("dataset,model\n")
    note = publish([from_model(trained)], f"sqlite:///{mine}")
    assert note.startswith("**Not published**") and f"{mine} is no SQLite database" in note
    assert mine.read_text() == "dataset,model\n"


def test_no_note_holds_a_password(trained, monkeypatch):
    def down(uri):
        raise OSError(f"no connection to {uri}")

    monkeypatch.setattr("myowave.tracking.store.start_page", down)
    note = publish([from_model(trained)], "http://me:hunter2@127.0.0.1:9")
    assert note.startswith("**Not published**") and "hunter2" not in note
    with pytest.raises(ValueError) as caught:
        serve("postgresql://me:hunter2@127.0.0.1:9/none")
    assert "hunter2" not in str(caught.value) and "cannot be opened" in str(caught.value)


def test_a_moved_store_finds_its_artifacts_again(trained, uri, tmp_path):
    publish([from_model(trained)], uri)
    moved = tmp_path / "elsewhere"
    (tmp_path / "results").rename(moved)
    there = TrainedModel(moved / trained.folder.relative_to(tmp_path / "results"), trained.settings, ())
    publish([from_model(there)], f"sqlite:///{moved}/mlflow.db")
    client, parent, _ = stored(f"sqlite:///{moved}/mlflow.db")
    assert parent.info.artifact_uri.startswith(moved.as_uri())
    assert [item.path for item in client.list_artifacts(parent.info.run_id)] == ["evaluation.csv"]


@contextmanager
def running_server(folder, port):
    """A real MLflow server with a store and artifacts of its own; the same again after a pause."""
    log = (folder / "server.log").open("a")
    server = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "mlflow",
            "server",
            "--port",
            str(port),
            "--workers",
            "1",
            "--backend-store-uri",
            f"sqlite:///{folder}/server.db",
            "--artifacts-destination",
            str(folder / "kept"),
        ],
        env=os.environ | {"MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false"},
        stdout=log,
        stderr=log,
    )
    try:
        for _ in range(300):
            try:
                urllib.request.urlopen(f"http://127.0.0.1:{port}/health", timeout=1).close()
                break
            except OSError:
                assert server.poll() is None, (folder / "server.log").read_text()
                time.sleep(0.1)
        yield f"http://127.0.0.1:{port}"
    finally:
        server.terminate()
        server.wait(timeout=20)
        log.close()


def test_a_server_takes_the_runs_and_while_it_is_down_nothing_is_lost(trained, tmp_path, empty_store, capfd):
    shutil.copy(empty_store, tmp_path / "server.db")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    began = time.monotonic()
    note = publish([from_model(trained)], f"http://127.0.0.1:{port}")
    assert time.monotonic() - began < 10, "a run does not wait for a server that is not there"
    assert note.startswith("**Not published**") and str(port) in note and "refused" in note, note
    assert len(note.splitlines()) <= 3, "one message, no trace"
    with pytest.raises(ValueError, match="refused"):
        publish([from_model(trained)], f"http://127.0.0.1:{port}", needed=True)

    with running_server(tmp_path, port) as uri:
        assert publish([from_model(trained)], uri).startswith(f"{SEEDS + 1} runs written to {uri}")
        client, parent, children = stored(uri)
        table = pd.read_csv(trained.folder / "evaluation.csv")
        assert [run.data.metrics["test_r2"] for run in children] == pytest.approx(table["test_r2"].tolist())
        picture = client.download_artifacts(parent.info.run_id, "metrics.png", tmp_path)
        assert Path(picture).read_bytes() == b"a picture"
        assert list((tmp_path / "kept").rglob("metrics.png")), "the server keeps it, not the client"
        assert publish([from_model(trained)], uri).startswith("0 runs written")
    assert capfd.readouterr().out == "", "the note says it all"


def test_the_first_page_is_the_prepared_view_of_the_only_experiment(trained, uri):
    publish([from_model(trained)], uri)
    (experiment,) = mlflow.MlflowClient(tracking_uri=uri).search_experiments()
    page = start_page(uri).removeprefix("/")
    assert page.startswith(f"#/experiments/{experiment.experiment_id}/runs?viewStateShareKey=")
    assert f"({page})" in experiment.tags["mlflow.note.content"], "who comes another way finds a link to it"
    key = page.split("viewStateShareKey=")[1].split("&")[0]
    (group,) = json.loads(experiment.tags[f"mlflow.sharedViewState.{key}"])["groupBy"]["groupByKeys"]
    client, parent, children = stored(uri)
    assert {run.data.tags[group["groupByData"]] for run in children} == {"case1 base rollout"}, "a line for all scales"
    view = json.loads(experiment.tags[f"mlflow.sharedViewState.{key}"])
    assert view["searchFilter"] == f"tags.kind = '{parent.data.tags['kind']}'", "a point is a median over seeds"
    (point,) = client.get_metric_history(parent.info.run_id, BY_SCALES)
    assert (point.step, point.value) == (2, pytest.approx(parent.data.metrics["test_rmse_deg"]))
    (point,) = client.get_metric_history(children[0].info.run_id, BY_SCALES)
    assert (point.step, point.value) == (2, pytest.approx(children[0].data.metrics["test_rmse_deg"]))


def test_errors_are_in_degrees_and_parameters_have_their_standard_errors(trained, uri):
    group = from_model(trained)
    publish([group], uri)
    _, parent, children = stored(uri)
    for run, se in zip(children, (0.5, 0.6, 0.7), strict=True):
        assert run.data.metrics["test_rmse_deg"] == pytest.approx(np.rad2deg(run.data.metrics["test_mse"] ** 0.5))
        assert run.data.metrics["f0_Bi_se"] == pytest.approx(se)
    assert parent.data.metrics["f0_Bi_se"] == pytest.approx(0.6)
    assert "nan" not in parent.data.tags["mlflow.note.content"] and "f0_Bi_error_pct" not in parent.data.metrics


def test_the_first_page_of_the_server_opens_experiments_as_machine_learning():
    code = (
        "from myowave.tracking.store import browser_app; page = browser_app().router.routes[0]; "
        "print(page.path, page.endpoint().body.decode())"
    )
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True)
    assert done.stdout.startswith("/ <!doctype"), done.stderr
    assert 'setItem("mlflow.workflowType_v1", "\\"machine_learning\\"")' in done.stdout
    script, page = done.stdout.index("<script>"), done.stdout.index("main.")
    assert script < page, "before MLflow's own scripts read it"


def test_the_ui_says_where_there_is_nothing_to_show(tmp_path):
    with pytest.raises(ValueError, match="no MLflow store"):
        serve(f"sqlite:///{tmp_path}/mlflow.db")


def test_a_sweep_has_a_run_for_each_trial_below_its_search(tmp_path, empty_store):
    trials = pd.DataFrame(
        {
            "trial": [0, 1, 2],
            "state": ["complete", "pruned", "fail"],
            "error": [2.0, np.nan, np.nan],
            "hidden": [50, 20, 30],
            "beta": [0.1, 0.2, 0.3],
            "after_2": [2.0, np.nan, np.nan],
            "after_1": [3.0, 9.0, np.nan],
            "seed_0": [1.5, 8.0, np.nan],
            "seed_1": [2.5, 10.0, np.nan],
            "is_default": [True, False, False],
            "duration_s": [4.0, 1.0, np.nan],
            "worker": "w 0",
        }
    )
    scores = pd.DataFrame(
        {
            "setting": ["default", "best"],
            "dataset": "case1",
            "model": "base",
            "recipe": ["rollout", "rollout_best"],
            "scales": 2,
            "seed": 0,
            "test_mse": [0.2, 0.1],
            "test_r2": [0.8, 0.9],
        }
    )
    trials.to_csv(tmp_path / "trials.csv", index=False)
    scores.to_csv(tmp_path / "test_scores.csv", index=False)
    (tmp_path / "best.yaml").write_text("learning: {}")
    (tmp_path / "summary.md").write_text("hidden lies at the high edge")
    store = tmp_path / "mlflow.db"
    shutil.copy(empty_store, store)
    publish([from_sweep(Swept(tmp_path))], f"sqlite:///{store}")

    client = mlflow.MlflowClient(tracking_uri=f"sqlite:///{store}")
    runs = client.search_runs([client.get_experiment_by_name(SWEEPS).experiment_id])
    search = next(run for run in runs if run.data.tags["kind"] == "search")
    below = {run.info.run_name: run for run in runs if run.data.tags.get("mlflow.parentRunId") == search.info.run_id}
    assert set(below) == {"trial 000", "trial 001 (pruned)", "trial 002 (fail)"}
    assert search.data.metrics["best_test_r2"] == 0.9 and search.data.metrics["default_test_r2"] == 0.8
    assert search.data.params["hidden"] == "50"
    assert "high edge" in search.data.tags["mlflow.note.content"]
    pruned = below["trial 001 (pruned)"].data
    assert pruned.params["hidden"] == "20" and "held_out_error_deg" not in pruned.metrics
    assert pruned.metrics["held_out_error_deg/seed_1"] == 10.0
