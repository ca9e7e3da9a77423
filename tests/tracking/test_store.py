"""MLflow holds what the result files say, once; it can be made again, and its failures stay its own."""

import fcntl
import json
import os
import re
import shutil
import socket
import sqlite3
import subprocess
import sys
import time
import urllib.request
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

import mlflow
import numpy as np
import pandas as pd
import pytest

from myowave.data.store import write_table
from myowave.tracking.contents import CURVE_POINTS, read_results
from myowave.tracking.store import EXPERIMENT, publish, serve, start_page

SEEDS = 3
EPOCHS = {1: 150, 0: 250}
RECIPES = {"rollout": {"hidden": 50, "beta": 1e-3}}


def write_network(results: Path, scales: int, val_r2: float) -> Path:
    """Result files of a network, as the workflow leaves them."""
    folder = results / f"learning/case1/base/rollout/{scales}-scale"
    folder.mkdir(parents=True)
    random = np.random.default_rng(scales)
    where = {"dataset": "case1", "model": "base", "recipe": "rollout", "scales": scales, "seed": range(SEEDS)}
    scores = {"test_rmse_deg": random.random(SEEDS), "test_r2": random.random(SEEDS), "val_r2": val_r2}
    table = pd.DataFrame(
        {**where, "epochs": 400, **scores, "f0_Bi": 300 + random.random(SEEDS), "f0_Bi_error_pct": np.nan}
    )
    table.assign(seconds=12.0).to_csv(folder / "evaluation.csv", index=False)
    for level in range(scales):
        epochs = np.arange(1, EPOCHS[level] + 1)
        history = [pd.DataFrame({"epoch": epochs, "seed": s, "loss": random.random(len(epochs))}) for s in range(SEEDS)]
        write_table(pd.concat(history), folder / f"history-{level}.parquet")
    return folder


@pytest.fixture
def results(tmp_path, facts):
    """Two networks and a verdict of one dataset."""
    folder = tmp_path / "results"
    write_network(folder, 1, val_r2=0.8)
    write_network(folder, 2, val_r2=0.9)
    (folder / "diagnosis/case1").mkdir(parents=True)
    (folder / "diagnosis/case1/verdict.json").write_text(json.dumps(facts(dataset="case1", missing_deg=1.5)))
    (folder / "diagnosis/case1/verdict.html").write_text("the story")
    ladder = pd.DataFrame({"model": ["base", "base+joint_damping"], "heldout_rmse_deg": [4.0, 0.6]})
    ladder.to_csv(folder / "diagnosis/case1/ladder.csv", index=False)
    (folder / "figures/case1").mkdir(parents=True)
    (folder / "figures/case1/trials.png").write_bytes(b"a picture")
    return folder


def test_a_baseline_is_a_run_without_curves_and_is_not_the_network_of_its_dataset(results):
    rival = results / "learning/case1/base/another/1-scale"
    rival.mkdir(parents=True)
    table = pd.read_csv(results / "learning/case1/base/rollout/1-scale/evaluation.csv").assign(recipe="another")
    table.assign(val_r2=np.nan, test_r2=1.0).to_csv(rival / "evaluation.csv", index=False)
    for folder in (results / "learning/case1/base/rollout").iterdir():  # none was validated
        own = pd.read_csv(folder / "evaluation.csv")
        own.assign(val_r2=np.nan).to_csv(folder / "evaluation.csv", index=False)
    (dataset, *runs), *_ = read_results(results, {"rollout": {"method": "rollout"}, "another": {"kind": "ridge"}})
    assert dataset.params["recipe"] == "rollout" and "another" in dataset.description
    assert [run.curves.empty for run in runs if run.params["recipe"] == "another"] == [True] * SEEDS


@pytest.fixture(scope="module")
def empty_store(tmp_path_factory):
    """A sqlite file with MLflow's tables and nothing in it: making them takes seconds."""
    path = tmp_path_factory.mktemp("store") / "mlflow.db"
    assert publish([], f"sqlite:///{path}").startswith("0 runs written")
    return path


@pytest.fixture
def uri(results, empty_store):
    shutil.copy(empty_store, results / "mlflow.db")
    return f"sqlite:///{results}/mlflow.db"


def published(results, uri, **more):
    return publish(read_results(results, RECIPES), uri, **more)


def stored(uri):
    """(client, run of the dataset, runs of the seeds by name)."""
    client = mlflow.MlflowClient(tracking_uri=uri)
    runs = client.search_runs([client.get_experiment_by_name(EXPERIMENT).experiment_id])
    (parent,) = (run for run in runs if "mlflow.parentRunId" not in run.data.tags)
    below = [run for run in runs if run.data.tags.get("mlflow.parentRunId") == parent.info.run_id]
    assert len(below) == len(runs) - 1
    return client, parent, {run.info.run_name: run for run in below}


def test_each_seed_has_a_run_and_the_dataset_its_verdict_and_the_medians_of_its_best_network(results, uri):
    # The other network is the better one on test trials, which choose nothing.
    other = results / "learning/case1/base/rollout/1-scale/evaluation.csv"
    pd.read_csv(other).assign(test_r2=0.9999).to_csv(other, index=False)
    published(results, uri)
    _, parent, below = stored(uri)
    assert len(below) == 2 * SEEDS
    table = pd.read_csv(results / "learning/case1/base/rollout/2-scale/evaluation.csv")
    for seed in range(SEEDS):
        run = below[f"case1 base rollout 2-scale seed {seed}"]
        for name in ("test_rmse_deg", "test_r2", "f0_Bi"):
            assert run.data.metrics[name] == pytest.approx(table[name][seed])
        assert run.data.params.items() >= {"hidden": "50", "recipe": "rollout", "scales": "2"}.items()
        assert run.info.end_time - run.info.start_time == 12_000
    assert parent.info.run_name == "case1: missing: damping of the joint"
    assert parent.data.metrics["test_r2"] == pytest.approx(table["test_r2"].median()), "best on validation trials"
    shown = {"scales": "2", "recipe": "rollout", "verdict": "missing", "missing": "joint_damping"}
    assert parent.data.params.items() >= shown.items()
    errors = {"heldout_rmse_deg": 0.6, "base_heldout_rmse_deg": 4.0, "missing_deg": 1.5}
    assert parent.data.metrics.items() >= errors.items() and "f0_Bi_error_pct" not in parent.data.metrics
    assert "Missing: damping of the joint." in parent.data.tags["mlflow.note.content"]


def test_curves_run_through_the_scales_from_the_coarsest(results, uri):
    published(results, uri)
    client, _, below = stored(uri)
    curve = client.get_metric_history(below["case1 base rollout 2-scale seed 1"].info.run_id, "curve/loss")
    steps = [point.step for point in curve]
    assert steps == sorted(set(steps)) and steps[-1] == sum(EPOCHS.values())
    assert CURVE_POINTS / 2 < len(steps) < 2 * CURVE_POINTS
    coarse = pd.read_parquet(results / "learning/case1/base/rollout/2-scale/history-1.parquet").query("seed == 1")
    assert curve[0].value == pytest.approx(coarse.set_index("epoch")["loss"][steps[0]])


def test_a_dataset_without_networks_and_one_without_a_verdict_are_shown(results, uri):
    shutil.rmtree(results / "learning")
    published(results, uri)
    assert stored(uri)[1].info.run_name == "case1: missing: damping of the joint"
    shutil.rmtree(results / "diagnosis")
    write_network(results, 1, val_r2=np.nan)
    published(results, uri)
    assert stored(uri)[1].info.run_name == "case1" and len(stored(uri)[2]) == SEEDS


def test_publishing_again_changes_nothing(results, uri):
    published(results, uri)
    before = stored(uri)
    assert published(results, uri).startswith("0 runs written")
    assert stored(uri)[1].info.run_id == before[1].info.run_id and set(stored(uri)[2]) == set(before[2])


def test_changed_results_replace_their_runs_and_what_cannot_be_made_again_is_kept(results, uri):
    published(results, uri)
    shutil.rmtree(results / "learning/case1/base/rollout/1-scale")
    path = results / "learning/case1/base/rollout/2-scale/evaluation.csv"
    pd.read_csv(path).assign(test_r2=0.123).to_csv(path, index=False)
    note = published(results, uri)
    assert f"{SEEDS + 1} of them in place of older ones" in note and f"{SEEDS} whose files are gone kept" in note
    client = mlflow.MlflowClient(tracking_uri=uri)
    runs = client.search_runs([client.get_experiment_by_name(EXPERIMENT).experiment_id])
    assert len(runs) == 1 + 2 * SEEDS
    assert [run.data.metrics["test_r2"] for run in runs].count(0.123) == 1 + SEEDS
    folders = list((results / "mlartifacts" / EXPERIMENT).iterdir())
    assert len(folders) == 1, "what a replaced run held is not left behind"


def test_a_run_cut_off_in_the_middle_has_an_end_and_is_written_again(results, uri, monkeypatch):
    with monkeypatch.context() as failing:
        failing.setattr(shutil, "copyfileobj", lambda *_, **__: (_ for _ in ()).throw(OSError(28, "No space left")))
        assert "No space left" in published(results, uri)
    client = mlflow.MlflowClient(tracking_uri=uri)
    experiment = client.get_experiment_by_name(EXPERIMENT).experiment_id
    (failed,) = client.search_runs([experiment])
    assert failed.info.status == "FAILED"
    killed = client.create_run(experiment, tags={"key": "gone"}).info.run_id
    published(results, uri)
    assert client.get_run(killed).info.status == "KILLED"
    runs = client.search_runs([experiment], "tags.key != 'gone'")
    assert {run.info.status for run in runs} == {"FINISHED"} and len(runs) == 1 + 2 * SEEDS


def test_a_store_that_was_killed_while_it_was_made_is_not_there_and_the_next_one_is_whole(results, tmp_path):
    path, draft = tmp_path / "new/mlflow.db", tmp_path / "new/.mlflow.db.draft"
    code = f"from myowave.tracking.store import publish; publish([], 'sqlite:///{path}')"
    with subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL) as making:
        while not (draft.exists() and draft.stat().st_size > 4096):
            assert making.poll() is None and not path.exists()
            time.sleep(0.005)
        making.kill()
    assert draft.exists() and not path.exists(), "it was killed in the middle"
    assert published(results, f"sqlite:///{path}").startswith(f"{2 * SEEDS + 1} runs written")
    assert not draft.exists()


def test_two_that_publish_take_turns(results, uri):
    with open(results / ".mlflow.db.publishing", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        waiting = Thread(target=published, args=(results, uri))
        waiting.start()
        waiting.join(timeout=1)
        assert waiting.is_alive() and mlflow.MlflowClient(tracking_uri=uri).get_experiment_by_name(EXPERIMENT)
        assert not (results / "mlartifacts").exists()
    waiting.join()
    assert len(stored(uri)[2]) == 2 * SEEDS


def cut_short(path):
    path.write_bytes(path.read_bytes()[:50_000])


def without_tables(path):
    with sqlite3.connect(path) as database:
        for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall():
            database.execute(f"DROP TABLE IF EXISTS '{name}'")
    database.close()


def with_tables_of_another_version(path):
    with sqlite3.connect(path) as database:
        database.execute("UPDATE alembic_version SET version_num = 'ff01da956556'")
    database.close()


@pytest.mark.parametrize("damage", [cut_short, without_tables, with_tables_of_another_version])
def test_a_store_that_cannot_be_opened_is_left_alone_and_one_is_told_what_to_do(results, uri, damage):
    path = results / "mlflow.db"
    damage(path)
    damaged = path.read_bytes()
    note = published(results, uri)
    assert note.startswith("**Not published**") and "delete it and publish again" in note
    assert len(note.splitlines()) <= 3, "one message, no trace"
    with pytest.raises(ValueError, match="delete it and publish again"):
        serve(uri)
    assert path.read_bytes() == damaged


def test_nothing_but_a_store_is_ever_written(results, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mine = {
        "summary.csv": "dataset,model\n",
        "environment.lock": "torch==2",
        ".environment.publishing": "mine",
        "x": "",
    }
    for name, text in mine.items():
        Path(name).write_text(text)
    with sqlite3.connect("other.db") as database:
        database.execute("CREATE TABLE studies (x)")
    database.close()
    other = Path("other.db").read_bytes()
    for name in ("summary.csv", "environment.lock", "x", "results", "other.db"):
        note = published(results, f"sqlite:///{name}")
        assert note.startswith("**Not published**") and re.search("is no (file|MLflow store)", note), note
    assert published(results, "sqlite:///environment").startswith(f"{2 * SEEDS + 1} runs written")
    assert {name: Path(name).read_text() for name in mine} == mine and Path("other.db").read_bytes() == other


def test_a_moved_store_still_opens_its_artifacts(results, uri, tmp_path, monkeypatch):
    published(results, uri)
    _, parent, _ = stored(uri)
    moved = results.rename(tmp_path / "elsewhere")
    command = []
    monkeypatch.setattr(os, "execv", lambda program, arguments: command.extend(arguments))
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(ValueError, match=f"Port {port} is in use already"):
            serve(f"sqlite:///{moved}/mlflow.db", port)
    assert not command
    serve(f"sqlite:///{moved}/mlflow.db", port)
    root = Path(command[command.index("--artifacts-destination") + 1])
    inside = parent.info.artifact_uri.removeprefix("mlflow-artifacts:/")
    found = {path.relative_to(root / inside).as_posix() for path in (root / inside).rglob("*") if path.is_file()}
    assert found >= {"verdict.html", "verdict.json", "ladder.csv", "figures/trials.png"}
    assert "base/rollout/2-scale/evaluation.csv" in found
    assert published(moved, f"sqlite:///{moved}/mlflow.db").startswith("0 runs written"), "nothing to make again"


@pytest.mark.parametrize("address", ["http://me:hunter2@127.0.0.1:9?key=hunter2", "http://127.0.0.1:9/a;key=hunter2"])
def test_no_note_holds_a_password(results, address):
    note = published(results, address)
    assert note.startswith("**Not published**") and "hunter2" not in note and "127.0.0.1:9" in note


@contextmanager
def running_server(folder, port):
    """A real MLflow server with a store and artifacts of its own."""
    where = ["--backend-store-uri", f"sqlite:///{folder}/server.db", "--artifacts-destination", str(folder / "kept")]
    with (folder / "server.log").open("a") as log:
        server = subprocess.Popen(
            [sys.executable, "-m", "mlflow", "server", "--port", str(port), "--workers", "1", *where],
            env=os.environ | {"MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false"},
            stdout=log,
            stderr=log,
        )
        try:
            for _ in range(600):
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


def test_a_server_takes_the_runs_and_while_it_is_down_nothing_is_lost(results, tmp_path, empty_store, capfd):
    shutil.copy(empty_store, tmp_path / "server.db")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    began = time.monotonic()
    note = published(results, f"http://127.0.0.1:{port}")
    assert time.monotonic() - began < 20, "a run does not wait for a server that is not there"
    assert note.startswith("**Not published**") and str(port) in note and "Start the server" in note, note
    assert len(note.splitlines()) <= 3, "one message, no trace"
    with pytest.raises(ValueError, match="Start the server"):
        published(results, f"http://127.0.0.1:{port}", needed=True)

    with running_server(tmp_path, port) as uri:
        assert published(results, uri).startswith(f"{2 * SEEDS + 1} runs written to {uri}")
        client, parent, _ = stored(uri)
        picture = client.download_artifacts(parent.info.run_id, "figures/trials.png", tmp_path)
        assert Path(picture).read_bytes() == b"a picture"
        assert list((tmp_path / "kept").rglob("trials.png")), "the server keeps it, not the client"
        assert published(results, uri).startswith("0 runs written")
    assert capfd.readouterr().out == "", "the note says it all"


def test_the_first_page_is_the_table_of_runs_with_scores_and_recipe(results, uri):
    published(results, uri)
    experiment = mlflow.MlflowClient(tracking_uri=uri).get_experiment_by_name(EXPERIMENT)
    page = start_page(uri)
    assert page.startswith(f"/#/experiments/{experiment.experiment_id}/runs?") and "compareRunsMode=TABLE" in page
    key = page.split("viewStateShareKey=")[1]
    table = json.loads(experiment.tags[f"mlflow.sharedViewState.{key}"])
    _, *first = table["columnOrder"][:4]
    assert first == ["metrics.`test_r2`", "metrics.`test_rmse_deg`", "params.`recipe`"], "before duration: all in sight"
    assert set(first) <= set(table["selectedColumns"])


def test_the_ui_says_where_there_is_nothing_to_show(tmp_path):
    with pytest.raises(ValueError, match="no MLflow store"):
        serve(f"sqlite:///{tmp_path}/mlflow.db")
