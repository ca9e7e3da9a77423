"""What is made again after a change: what depends on it, and nothing else.

All outputs are put there by hand and recorded with `--touch`; then each change is made, planned, and taken back.
"""

import os
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import pytest
import yaml
from project_copy import ROOT, Project, copy_project

# The bench elbow has an arm of its own, of other strength; nobody has the arm `spare`.
PAPER = yaml.safe_load((ROOT / "config.yaml").read_text())["physics"]["arms"]["paper"]
ARM = {key: PAPER[key] for key in ("muscles", "joint")}
BENCH = {"arm": "bench", "changed": {"reference": ["trial1"], "against": ["trial2"]}}
SMALL = {
    "targets": {"datasets": ["case1", "case2", "bench_elbow"], "scales": [1, 2], "follow_verdict": []},
    "physics": {"arms": {"bench": ARM, "spare": ARM}},
    "data": {"datasets": {"bench_elbow": BENCH}},
}
CONFIG = ("--configfile", "config.yaml", "mine.yaml")
LEARNING = {"train_scale", "evaluate_model", "summarize_models", "judge_scales", "publish_runs"}
WATCHING = {"watch_ladder", "draw_diagnosis", "tell_verdict"}
DIAGNOSIS = {"diagnose_dataset", "score_verdict"} | WATCHING


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Project:
    """A project where every output of a small configuration is there and recorded as done."""
    project = copy_project(tmp_path_factory.mktemp("finished"))
    project.finish(*project.lay_over(SMALL))
    return project


@contextmanager
def edited(project: Project, path: str, old: str, new: str) -> Iterator[None]:
    """Replace text in a file for a while."""
    file = project.folder / path
    original = file.read_text()
    assert old in original, f"{path} no longer holds {old!r}"
    file.write_text(original.replace(old, new, 1))
    try:
        yield
    finally:
        file.write_text(original)


def test_a_recording_put_back_with_an_older_date_and_a_setting_rerun_what_reads_them(finished):
    path = finished.folder / "data/bench_elbow/trial2.csv"
    original, date = path.read_bytes(), path.stat().st_mtime_ns
    path.write_bytes(original.replace(b"0.01,", b"0.010,", 1))
    os.utime(path, ns=(date, date - 10**12))
    with edited(finished, "config.yaml", "emg_noise: 0.15", "emg_noise: 0.16"):
        planned = finished.planned(*CONFIG)
    path.write_bytes(original)
    os.utime(path, ns=(date, date))
    assert planned["import_trials"] == 1, "the dates alone would miss it"
    assert planned["simulate_trials"] == 1 and planned["train_scale"] == 3 + 3, "case1 reads neither"


def test_changed_physics_reruns_all_that_stands_on_it(finished):
    with edited(finished, "src/myowave/physics/joint.py", "9.80665", "9.81"):
        planned = finished.planned(*CONFIG)
    assert set(planned) >= {"simulate_trials", "decompose_scales"} | LEARNING | {"draw_models"}
    assert "import_trials" not in planned, "recordings stay what they are"


def test_changed_networks_rerun_training_and_what_follows_but_no_diagnosis(finished):
    with edited(finished, "src/myowave/learning/network.py", "\ndef ", "\nCHANGED = 1\n\n\ndef "):
        assert set(finished.planned(*CONFIG)) == LEARNING | WATCHING | {
            "draw_models",
            "score_baselines",
            "list_datasets",
        }


def test_a_network_beside_that_was_trained_anew_is_seen_by_the_tables(finished):
    beside = finished.folder / "results/learning/case1/base/other/1-scale"
    beside.mkdir(parents=True)
    for name in ("evaluation.csv", "scale-0.pt"):
        (beside / name).write_text("before")
    finished.finish(*CONFIG)
    assert not finished.planned(*CONFIG)
    (beside / "evaluation.csv").write_text("anew")
    planned = finished.planned(*CONFIG)
    shutil.rmtree(beside)
    finished.finish(*CONFIG)
    assert {"summarize_models", "watch_ladder"} <= set(planned) and planned["watch_ladder"] == 1, "of its dataset alone"


def test_what_mlflow_shows_is_published_anew_with_its_code_and_after_pictures_of_data(finished):
    with edited(finished, "src/myowave/tracking/contents.py", "\ndef ", "\nCHANGED = 1\n\n\ndef "):
        assert set(finished.planned(*CONFIG)) == {"publish_runs"}
    with edited(finished, "src/myowave/data/figures.py", "\ndef ", "\nCHANGED = 1\n\n\ndef "):
        assert "publish_runs" in finished.planned(*CONFIG)


def test_nothing_is_made_again_after_a_move_comments_and_changes_of_what_no_job_uses(finished, tmp_path):
    moved = Project(tmp_path / "elsewhere")
    shutil.copytree(finished.folder, moved.folder)
    heavier = {**ARM, "joint": {**ARM["joint"], "mass_kg": 1.3}}
    moved.lay_over({**SMALL, "physics": {"arms": {**SMALL["physics"]["arms"], "spare": heavier}}})
    unused = "    unused: {method: rollout, hidden: 3}\n"
    with ExitStack() as edits:
        for path, old, new in (
            ("src/myowave/learning/sweep/objective.py", "\ndef ", "\nCHANGED = 1\n\n\ndef "),
            ("src/myowave/learning/streaming/predictor.py", "\nclass ", "\nCHANGED = 1\n\n\nclass "),
            ("src/myowave/physics/joint.py", '"""', '# a comment\n"""Another docstring. '),
            ("config.yaml", "  recipes:\n", f"  recipes:\n{unused}"),
        ):
            edits.enter_context(edited(moved, path, old, new))
        assert moved.planned(*CONFIG) == {}


def test_changed_pages_drawings_and_addresses_rerun_only_what_shows(finished):
    with ExitStack() as edits:
        for path, old, new in (
            ("workflow/report/verdict.html.j2", "<h1>", "<h1 >"),
            ("src/myowave/data/figures.py", "\ndef ", "\nCHANGED = 1\n\n\ndef "),
            ("config.yaml", "uri: sqlite:///results/mlflow.db", "uri: sqlite:///results/other.db"),
            ("config.yaml", "about: OpenSim", "about: words for"),
            ("config.yaml", 'about: "simulated, nothing', 'about: "made, nothing'),
        ):
            edits.enter_context(edited(finished, path, old, new))
        planned = set(finished.planned(*CONFIG))
        assert planned == {"tell_verdict", "draw_trials", "list_datasets", "publish_runs"}


@pytest.mark.parametrize(
    ("key", "value", "used_by"),
    [
        ("identify", {"f0_Bi": {"start_spread": 0.1}}, LEARNING | DIAGNOSIS | {"draw_models", "compare_models"}),
        ("scatter", {"mass": {"relative": 0.1}}, DIAGNOSIS | {"compare_models", "tell_change", "publish_runs"}),
        ("changed", {"reference": ["trial1"], "against": ["trial4"]}, {"tell_change", "publish_runs"}),
    ],
)
def test_a_setting_that_no_trials_are_made_by_reruns_what_uses_it_and_no_import(finished, key, value, used_by):
    mine = (finished.folder / "mine.yaml").read_text()
    changed = {**SMALL, "data": {"datasets": {"bench_elbow": {**BENCH, key: value}}}}
    planned = finished.planned(*finished.lay_over(changed))
    (finished.folder / "mine.yaml").write_text(mine)
    assert set(planned) == used_by | {"list_datasets"}, "the index shows all settings"


def test_a_changed_arm_reruns_only_its_datasets(finished):
    mine = (finished.folder / "mine.yaml").read_text()
    heavier = {**ARM, "joint": {**ARM["joint"], "mass_kg": 1.3}}
    changed = {**SMALL, "physics": {"arms": {**SMALL["physics"]["arms"], "bench": heavier}}}
    planned = finished.planned(*finished.lay_over(changed))
    (finished.folder / "mine.yaml").write_text(mine)
    assert planned["train_scale"] == 3 and planned["diagnose_dataset"] == 1, "case1 and case2 have another arm"
    assert not {"simulate_trials", "import_trials"} & set(planned)
    assert planned["compare_models"] == 1, "so does all that compares its physics"
