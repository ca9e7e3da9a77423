"""The study hides what it says, and counts right and wrong as promised."""

import numpy as np
import pandas as pd
import pytest
import torch

from myowave.diagnosis.study.cases import (
    Case,
    add_noise,
    confusion_matrix,
    pair_cases,
    simulate_case,
    single_cases,
    summarize,
)
from myowave.diagnosis.study.figures import NOTHING, answers, hit_rates
from myowave.physics.drive import channels_of
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation


def test_every_hidden_value_is_within_its_bounds_and_not_zero(base, effects):
    for effect in effects.values():
        for case in single_cases(base, effect, (0.25, 1.0), range(1, 4)):
            for name, value in case.hidden[effect.name].items():
                parameter = base.with_effects([effect]).parameters_of(effect)[f"{effect.name}.{name}"]
                assert parameter.low <= value <= parameter.high and value != 0.0


def test_a_case_moves_as_the_simulator_says(base, effects, clean, dataset):
    case = Case({"joint_damping": {"c": 1.0}}, 3)
    trials = simulate_case(case, clean, dataset, base, effects)
    model = base.with_effects([effects["joint_damping"]])
    emg = channels_of(base, clean.channels, torch.from_numpy(clean.emg))
    motion = simulate(Simulation(model, {"joint_damping.c": 1.0}, emg, clean.dt), dataset.start_rad)
    np.testing.assert_allclose(trials.angle, motion.angle.numpy(), atol=1e-8)
    assert simulate_case(Case({}, 3), clean, dataset, base, effects) is clean


def test_noise_is_as_large_as_asked_and_the_same_every_time(clean):
    noise = add_noise(clean, 2.0, 1).angle - clean.angle
    assert np.degrees(noise.std()) == pytest.approx(2.0, rel=0.1)
    np.testing.assert_array_equal(add_noise(clean, 2.0, 1).angle, add_noise(clean, 2.0, 1).angle)


def test_a_pair_hides_both(base, effects):
    case = next(pair_cases(base, [effects["fatigue"], effects["gravity_tilt"]], [1]))
    assert set(case.hidden) == {"fatigue", "gravity_tilt"}


def test_only_visible_effects_count_and_false_alarms_are_counted():
    row = {
        "strength": 1.0,
        "noise_deg": 1.0,
        "worst_error_base_pct": 5.0,
        "worst_error_final_pct": 0.5,
        "heldout_deg": 1.0,
        "heldout_base_deg": 1.5,
        "rmse_over_noise": 1.0,
        "intervals": 5,
        "covered": 5,
        "seconds": 1.0,
        "wrong_name": False,
        "absorbed": "",
    }
    rows = pd.DataFrame(
        [
            row | {"hidden": "a", "signal": 2.0, "hit": True, "found": "a", "verdict": "effect"},
            row | {"hidden": "a", "signal": 2.0, "hit": False, "found": "b", "verdict": "effect", "wrong_name": True},
            row | {"hidden": "a", "signal": 0.5, "hit": False, "found": "", "verdict": "adequate"},
            row | {"hidden": "none", "signal": 0.0, "hit": False, "found": "a", "verdict": "effect"},
            row | {"hidden": "b", "signal": 0.0, "hit": False, "found": "", "verdict": "adequate", "absorbed": "b c"},
        ]
    )
    summary = summarize(rows)
    assert summary["by_noise"]["1.0"]["hit_pct"] == 50.0 and summary["wrong_name_pct"] == 50.0
    assert summary["false_alarms"] == 1 and summary["clean"] == 1
    assert summary["aliases"] == ["b"] and summary["aliases_reported_pct"] == 100.0
    matrix = confusion_matrix(rows)
    assert matrix.loc["a"].sum() == 2 and matrix.loc["a", "b"] == 1


def test_the_picture_shows_what_an_effect_was_taken_for_and_how_often_the_answer_was_right():
    cases = pd.DataFrame(
        [
            ("a", 1.0, "a/b", True, "class"),
            ("a", 3.0, "", False, "adequate"),
            ("b", 1.0, "b", True, "effect"),
            ("a+b", 1.0, "a + b", True, "effect"),
            ("none", 1.0, "", False, "adequate"),
        ],
        columns=["hidden", "noise_deg", "found", "hit", "verdict"],
    )
    held = answers(cases)
    assert list(held.index) == ["a", "b", "a+b", "none"]
    assert held.loc["a"].to_dict() == {"a": 50.0, "b": 50.0, NOTHING: 50.0}
    assert held.loc["a+b"].to_dict() == {"a": 100.0, "b": 100.0, NOTHING: 0.0}
    rates = hit_rates(cases)
    assert rates.loc["a"].tolist() == [100.0, 0.0] and rates.loc["none", 1.0] == 100.0
    assert np.isnan(rates.loc["b", 3.0])
