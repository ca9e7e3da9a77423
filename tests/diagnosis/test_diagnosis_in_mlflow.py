"""What MLflow is given of a diagnosis: the verdict, the curve that falls, a run for each model, and its duration."""

import json
import os

import pandas as pd
import pytest

from myowave.tracking.contents import DIAGNOSIS, from_diagnosis

LADDER = pd.DataFrame(
    {
        "model": ["base", "base+tilt", "base+fatigue"],
        "effects": [0, 1, 1],
        "named": [False, False, True],
        "train_rmse_deg": [3.0, 0.5, 2.0],
        "heldout_rmse_deg": [4.0, 0.6, 5.0],
        "noise_deg": [0.5, 0.5, 0.5],
        "missing_torque_Nm": [1.0, 0.0, 0.7],
    }
)
VERDICT = {
    "dataset": "me",
    "verdict": "effect",
    "effects": ["tilt"],
    "model": "base+tilt",
    "sentence": "Missing: tilt.",
    "where": "The misfit grows.",
    "command": "snakemake --cores 2 this --configfile mine.yaml",
    "parameters": {m: {"f0_Bi": {"value": 300.0, "se": 1.0, "error_pct": None}} for m in LADDER["model"]},
}
ENDED, LASTED = 1_700_000_000.0, 42.5


@pytest.fixture
def group(tmp_path):
    return written(tmp_path, VERDICT)


def written(tmp_path, verdict):
    (tmp_path / "verdict.json").write_text(json.dumps(verdict))
    (tmp_path / "verdict.html").write_text("the story")
    LADDER.to_csv(tmp_path / "ladder.csv", index=False)
    benchmark = tmp_path / "me.tsv"
    pd.DataFrame({"s": [LASTED], "h:m:s": ["0:00:42"]}).to_csv(benchmark, sep="\t", index=False)
    os.utime(benchmark, (ENDED, ENDED))
    return from_diagnosis(tmp_path, tmp_path, benchmark)


def test_runs_last_as_long_as_the_diagnosis_did(group):
    assert {(run.finished, run.duration_s) for run in (group.parent, *group.children)} == {(ENDED, LASTED)}


def test_the_curve_runs_over_the_models_of_the_search_alone(group):
    assert group.parent.curves["curve/heldout_rmse_deg"].to_dict() == {0: 4.0, 1: 0.6}
    assert group.parent.metrics["heldout_rmse_deg"] == 0.6, "of the model that was found"
    models = [run.params["model"] for run in group.children]
    assert models == list(LADDER["model"]), "and a model that was named has a run too"


def test_the_description_holds_the_verdict_and_points_to_the_command(group):
    assert VERDICT["sentence"] in group.parent.description and "command that adds" in group.parent.description
    assert max(map(len, group.parent.description.splitlines())) < 300, "no endless command line"


def test_noise_of_the_emg_is_among_the_effects_and_is_no_model_to_add(tmp_path):
    verdict = VERDICT | {"effects": ["emg_noise"], "model": "base", "sentence": "Missing: noise of the recorded EMG."}
    parent = written(tmp_path, verdict).parent
    assert parent.params["missing"] == "emg_noise" and "command" not in parent.description


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({}, "me: tilt"),
        ({"verdict": "adequate", "effects": [], "model": "base"}, "me: adequate"),
        ({"verdict": "unknown", "effects": [], "model": "base"}, "me: unknown"),
        ({"verdict": "class", "alternatives": [["tilt", "fatigue"]]}, "me: class tilt or fatigue"),
        (
            {"verdict": "partial", "effects": ["tilt", "fatigue"], "shares": {"tilt": 0.9, "fatigue": 0.1}},
            "me: partial tilt 90%, fatigue 10%",
        ),
    ],
)
def test_a_run_is_named_by_what_was_found_and_a_column_holds_the_verdict(tmp_path, changes, name):
    verdict = VERDICT | changes | {"missing_deg": 1.5, "missing_Nm": 0.7}
    parent = written(tmp_path, verdict).parent
    assert parent.name == name and parent.params["verdict"] == verdict["verdict"]
    assert (parent.metrics["missing_deg"], parent.metrics["missing_Nm"]) == (1.5, 0.7)
    assert parent.metrics["base_heldout_rmse_deg"] == 4.0, "beside that with what was found"


def test_all_datasets_share_one_experiment(group, tmp_path):
    assert written(tmp_path, VERDICT | {"dataset": "you"}).experiment == group.experiment == DIAGNOSIS
