"""The whole main job at a size that takes seconds: a simulated and a measured dataset, two scales, two seeds."""

import json
import re
import shlex
import shutil
import textwrap
from pathlib import Path

import pandas as pd
import pytest
from project_copy import Project, copy_project

import myowave

TINY = {
    "targets": {
        "datasets": ["case1", "bench_elbow"],
        "models": {"bench_elbow": ["base+joint_damping"]},
        "scales": [2],
        "follow_verdict": ["bench_elbow"],
    },
    "data": {"datasets": {"case1": {"samples": 120}}},
    "learning": {"seeds": 2, "recipes": {"rollout": {"epochs": 8, "hidden": 4, "simulated_trials": 2}}},
}
CONFIG = ("--configfile", "config.yaml", "mine.yaml")
BASELINES = {"hold", "ridge", "trees", "gru_plain", "cnn"}
KEYS = ["dataset", "model", "recipe", "scales", "seed"]
COLUMNS = [
    *KEYS,
    "test_mse",
    "test_r2",
    "test_nmse",
    "test_rmse_deg",
    "band_coverage",
    "outside_training",
    "val_r2",
    "epochs",
    "seconds",
]


pytestmark = pytest.mark.xdist_group("end_to_end")  # one job for all of these tests, whatever processes there are


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Project:
    project = copy_project(tmp_path_factory.mktemp("run"))
    project.lay_over(TINY)
    done = project.snakemake("--cores", "2", *CONFIG)
    assert done.returncode == 0, done.stdout
    assert f"All results on one page: {project.folder}/results/index.html" in done.stdout
    return project


@pytest.fixture(scope="module")
def verdict(run) -> dict:
    return json.loads((run.folder / "results/diagnosis/bench_elbow/verdict.json").read_text())


def test_the_summary_has_a_row_for_each_seed_of_each_combination(run, verdict):
    table = pd.read_csv(run.folder / "results/summary.csv")
    assert list(table.columns[: len(COLUMNS)]) == COLUMNS
    baselines = table[table["recipe"].isin(BASELINES)]
    assert set(baselines.groupby("recipe").size()) == {4} and set(baselines["recipe"]) == BASELINES
    table = table[~table["recipe"].isin(BASELINES)]
    keys = set(table[["dataset", "model", "scales", "seed"]].itertuples(index=False, name=None))
    expected = {("case1", "base", 2, 0), ("case1", "base", 2, 1)}
    models = {"base+joint_damping", verdict["model"]}
    expected |= {("bench_elbow", model, 2, seed) for model in models for seed in (0, 1)}
    assert len(models) == 2, "the network that follows the verdict is one of its own"
    assert keys == expected and len(table) == len(expected)
    assert table[COLUMNS].notna().all(axis=None)
    simulated, measured = table[table["dataset"] == "case1"], table[table["dataset"] == "bench_elbow"]
    for name in ("f0_Bi", "l0_Bi", "f0_Tri", "l0_Tri"):
        assert (table[name] > 0).all()
        assert simulated[f"{name}_error_pct"].notna().all(), "the truth is known"
        assert measured[f"{name}_error_pct"].isna().all(), "nobody knows the truth of a recording"


def test_every_picture_and_log_is_there(run):
    figures = run.folder / "results/figures"
    drawn = {path.relative_to(figures).as_posix() for path in figures.rglob("*.png")}
    for dataset, model in (("case1", "base"), ("bench_elbow", "base+joint_damping")):
        assert {f"{dataset}/{figure}.png" for figure in ("trials", "scales")} <= drawn
        models = {f"{dataset}/{model}/rollout/{f}.png" for f in ("metrics", "predictions", "parameters")}
        assert models <= drawn
    log = run.folder / "results/logs/train_scale/case1/base/rollout/2-scale/scale-1.log"
    lines = log.read_text().splitlines()
    assert lines[0] == "train case1 base rollout 2-scale, scale -1" and lines[-1].startswith("4/4 (100%) loss")


def test_the_ladder_shows_the_physics_and_the_network_of_the_verdict(run, verdict):
    watched = pd.read_csv(run.folder / "results/diagnosis/bench_elbow/watch.csv")
    shown = watched[watched["model"] == verdict["model"]].set_index("source")["heldout_rmse_deg"]
    assert set(shown.index) == {"physics", "network, rollout, 2-scale"} and (shown > 0).all()


def test_the_printed_command_makes_what_was_found_with_the_settings_of_the_run(run, verdict):
    train, show = (shlex.split(call)[1:] for call in verdict["command"].split(" && "))
    assert run.planned(*train) == {"draw_models": 1}, "two scales, as laid over, are trained already"
    assert run.planned(*show) == {}


def test_a_network_trained_on_demand_is_shown_beside_the_others(run):
    learned = run.folder / "results/learning/bench_elbow"
    more = learned / "base+vmax_change/rollout/2-scale"
    more.mkdir(parents=True)
    for name in ("evaluation.csv", "scale-0.pt"):  # what has no checkpoint holds no model
        shutil.copy(learned / "base+joint_damping/rollout/2-scale" / name, more)
    try:
        planned = run.planned("--cores", "2", "results/diagnosis/bench_elbow/verdict.html", *CONFIG)
    finally:
        shutil.rmtree(learned / "base+vmax_change")
    assert planned == {"watch_ladder": 1, "draw_diagnosis": 1, "tell_verdict": 1}


def test_the_index_leads_to_every_dataset_and_to_the_settings_of_the_run(run):
    page = (run.folder / "results/index.html").read_text()
    links = [link for link in re.findall(r'href="([^"#]+)"', page) if not link.startswith("http")]
    assert {"diagnosis/case1/verdict.html", "diagnosis/bench_elbow/verdict.html", "../mine.yaml"} <= set(links)
    assert [link for link in links if not (run.folder / "results" / link).exists()] == []
    assert "hidden_effect" not in page, "nobody is told what is hidden in a dataset"


def test_the_six_lines_of_python_say_what_the_rules_say_and_write_the_page(run, monkeypatch):
    monkeypatch.chdir(run.folder)
    example = textwrap.dedent(myowave.__doc__.partition("\n\n")[2])
    assert len(example.splitlines()) == 6
    names: dict = {}
    exec(example, names)
    found, ruled = names["d"].verdict, json.loads(Path("results/diagnosis/bench_elbow/verdict.json").read_text())
    assert found["verdict"] == "effect" and "joint_damping" in found["effects"]
    assert [found[key] for key in ("verdict", "effects", "model")] == [
        ruled[key] for key in ("verdict", "effects", "model")
    ]
    for name, one in found["parameters"]["base"].items():
        rule = ruled["parameters"]["base"][name]
        assert one["fitted"] == pytest.approx(rule["fitted"], rel=1e-9)
        assert one["value"] == pytest.approx(rule["value"], abs=1e-3 * rule["se"]), "sizes are sought to so much"
    assert names["d"].tables["parameters"]["model"].iloc[0] == "base"
    page = Path("bench_elbow.html").read_text()
    assert "joint_damping" in page and "data:image/png" in page
    assert "<pre></pre>" not in page and "Typed in the project" not in page, "no workflow made it: there is no command"


def test_the_runs_are_in_mlflow(run):
    note = (run.folder / "results/tracking/published.md").read_text()
    assert "Not published" not in note and (run.folder / "results/mlflow.db").exists(), note


def test_a_second_run_has_nothing_to_do(run):
    assert run.planned(*CONFIG) == {}


def test_after_an_interruption_training_goes_on_from_the_last_finished_scale(run):
    folder = run.folder / "results/learning/case1/base/rollout/2-scale"
    coarse = (folder / "scale-1.pt").stat().st_mtime_ns
    for path in ("scale-0.pt", "history-0.parquet"):
        (folder / path).unlink()
    done = run.snakemake("--cores", "2", str(folder.relative_to(run.folder) / "scale-0.pt"), *CONFIG)
    assert done.returncode == 0 and "1 of 1 steps" in done.stdout, done.stdout
    assert (folder / "scale-1.pt").stat().st_mtime_ns == coarse


def test_training_anew_that_fails_takes_nothing_of_before_away(run):
    folder, scales = run.folder / "results/learning/case1/base/rollout/2-scale", run.folder / "results/data/case1"
    trained, good = (folder / "scale-1.pt").read_bytes(), scales / "scales.parquet"
    good.rename(scales / "good.parquet")
    good.write_bytes(b"damaged")
    target = str(folder.relative_to(run.folder) / "scale-1.pt")
    done = run.snakemake("--cores", "1", target, "--forcerun", "train_scale", *CONFIG)
    assert done.returncode != 0 and "damaged" in done.stdout, done.stdout
    assert (folder / "scale-1.pt").read_bytes() == trained
    (scales / "good.parquet").rename(good)


def test_a_run_with_other_settings_takes_nothing_of_this_one_away(run):
    def rows():
        table = pd.read_csv(run.folder / "results/summary.csv").drop(columns="seconds")  # one was trained again above
        return table.sort_values(KEYS).reset_index(drop=True)

    def listed():
        return set(re.findall(r'href="diagnosis/(\w+)/verdict.html"', (run.folder / "results/index.html").read_text()))

    before, other = rows(), run.folder / "other.yaml"
    other.write_text("targets: {datasets: [case1], models: {}, follow_verdict: []}")
    done = run.snakemake("--cores", "1", *CONFIG, "other.yaml", "--", "results/summary.csv", "results/index.html")
    assert done.returncode == 0, done.stdout
    pd.testing.assert_frame_equal(rows(), before, check_dtype=False)
    assert listed() == {"case1", "bench_elbow"}


def test_a_faulty_recording_is_explained_on_the_terminal(project):
    path = project.folder / "data/bench_elbow/trial2.csv"
    lines = path.read_text().splitlines()
    lines[50] = lines[49]
    path.write_text("\n".join(lines) + "\n")
    done = project.snakemake("--cores", "1", "results/data/bench_elbow/trials.parquet")
    assert done.returncode != 0
    assert "trial2.csv, row" in done.stdout and "Traceback" not in done.stdout
