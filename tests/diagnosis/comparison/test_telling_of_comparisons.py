"""What is named of the comparisons: numbers in verdict.json, and sentences made of them."""

import json

import numpy as np
import pandas as pd
import pytest

from myowave.diagnosis.comparison.baselines import EMG_ONLY, HOLD, NOISE, POSTURE, POSTURE_LOAD, SAME_SPEED
from myowave.diagnosis.comparison.summary import summarize
from myowave.diagnosis.report.figures import draw_horizons, draw_torque, findings
from myowave.diagnosis.report.tell import tell

SHORT = pd.DataFrame([("base", np.inf, True, 5.0)], columns=["predictor", "horizon_s", "held_out", "rmse_deg"])
NO_NETWORKS = pd.DataFrame(columns=["source", "heldout_rmse_deg"])


def torque_of(posture: float, base: float, found: float, emg: float = 0.1) -> pd.DataFrame:
    """The same R2 on two held-out trials, and another one on a training trial that must not count."""
    r2 = {"base": base, "base+joint_damping": found, POSTURE: posture, EMG_ONLY: emg}
    rows = [(m, t, held, 1.0, v if held else 0.5) for m, v in r2.items() for t, held in (("1", False), ("2", True))]
    return pd.DataFrame(rows, columns=["model", "trial", "held_out", "rmse_Nm", "r2"])


@pytest.fixture
def tell_torque(facts):
    return lambda torque, model="base+joint_damping": tell(facts(model=model, **summarize(torque, SHORT)))["torque"]


@pytest.fixture
def asks_for_others(facts):
    """Whether the trials are said to tell too little, so that others are listed to record."""
    return lambda torque, model="base+joint_damping": bool(
        tell(facts(model=model, **summarize(torque, SHORT)))["session"]
    )


@pytest.fixture
def tell_horizons(facts):
    return lambda horizons, model="base+joint_damping": tell(
        facts(model=model, **summarize(torque_of(0.6, 0.7, 0.7), horizons))
    )["horizons"]


def test_the_sentence_names_what_posture_and_the_muscles_explain(tell_torque, asks_for_others):
    text = tell_torque(torque_of(0.61, 0.72, 0.93))
    assert "posture and speed alone 0.61" in text and "muscles of the model, driven by EMG, explain R² 0.72" in text
    assert "(with what was found: 0.93)" in text and not asks_for_others(torque_of(0.61, 0.72, 0.93))


@pytest.mark.parametrize(("found", "told"), [(0.30, "less than"), (0.615, "no more than"), (-np.inf, "less than")])
def test_where_muscles_explain_no_more_than_posture_it_says_so_and_what_to_record(
    found, told, tell_torque, asks_for_others
):
    torque = torque_of(0.61, 0.2, found)
    assert f"explain {told} posture and speed do" in tell_torque(torque) and asks_for_others(torque)


def test_trials_that_differ_in_no_load_by_the_settings_are_said_to_where_posture_explains_all(tell_torque):
    """Loads are 0 in a new study until they are filled in; then posture alone explains the torque of their motion."""
    torque = torque_of(0.99, 0.2, 0.2)
    assert "training trials the same load" in tell_torque(torque, "base")
    told = torque[torque["model"] == POSTURE].assign(model=POSTURE_LOAD)
    assert "training trials the same load" not in tell_torque(pd.concat([torque, told]), "base")
    assert "training trials the same load" not in tell_torque(torque_of(0.61, 0.9, 0.9), "base")


def test_muscles_that_explain_less_than_posture_and_load_are_told_to_and_what_to_record(tell_torque, asks_for_others):
    torque = torque_of(0.61, 0.79, 0.79)
    known = torque[torque["model"] == POSTURE].assign(model=POSTURE_LOAD, r2=0.95)
    assert "given the load" not in tell_torque(torque, "base")
    assert "0.61 and, given the load too, 0.95" in tell_torque(pd.concat([torque, known]), "base")
    assert asks_for_others(pd.concat([torque, known]), "base")
    assert not asks_for_others(pd.concat([torque, known.assign(r2=0.7)]), "base")


def test_what_better_muscles_could_explain_is_told(tell_torque):
    assert "could better muscles explain" in tell_torque(torque_of(0.61, 0.79, 0.79, emg=0.83))
    assert "better muscles" not in tell_torque(torque_of(0.61, 0.79, 0.83, emg=0.83))


def test_noise_that_hides_much_of_the_torque_is_told(tell_torque):
    torque = torque_of(0.61, 0.72, 0.83)
    noise = torque[torque["model"] == "base"].assign(model=NOISE, r2=[0.9, 0.84])
    assert "leaves about 0.84" in tell_torque(pd.concat([torque, noise]))
    assert "noise" not in tell_torque(pd.concat([torque, noise.assign(r2=0.999)]))


def test_a_first_model_that_loses_to_posture_asks_for_no_other_trials_if_what_was_found_wins(asks_for_others):
    assert not asks_for_others(torque_of(0.61, 0.2, 0.9))


def test_the_second_sentence_names_the_best_rival(tell_horizons):
    errors = {"base": 3.0, "base+joint_damping": 0.4, HOLD: 9.0, SAME_SPEED: 8.0, POSTURE: 5.0, EMG_ONLY: 6.0}
    rows = [(p, h, held, e + h) for p, e in errors.items() for h in (0.2, 0.5) for held in (False, True)]
    rows += [("base", np.inf, True, 12.0), ("base+joint_damping", np.inf, True, 0.7)]
    text = tell_horizons(pd.DataFrame(rows, columns=SHORT.columns))
    assert (
        "0.5 s after" in text
        and "the muscle model misses by 3.5 deg" in text
        and "muscle model with damping of the joint misses by 0.90 deg" in text
    )
    assert "(posture and speed) by 5.5 deg" in text


def test_what_overflows_is_said_in_text_and_picture(tell_torque, tell_horizons):
    torque = torque_of(0.61, -np.inf, -np.inf)
    assert "muscles of the model, driven by EMG, explain R² under -99" in tell_torque(torque, "base")
    texts = [text.get_text() for axis in draw_torque(torque).axes for text in axis.texts]
    assert texts and set(texts) == {"torque overflows"}
    rows = [(p, h, True, 1.0) for p in (HOLD, SAME_SPEED, POSTURE, EMG_ONLY) for h in (0.2, 0.5)]
    rows = [("base", 0.2, True, 5.0), ("base", 0.5, True, np.inf), *rows]
    horizons = pd.DataFrame(rows, columns=SHORT.columns)
    assert "muscle model misses by over 1000 deg" in tell_horizons(horizons, "base")
    told = json.loads(json.dumps(summarize(torque, horizons), allow_nan=False))
    assert told["horizons"]["rmse_deg"]["base"] is None and told["torque"]["r2"]["base"] < 0
    overflowing = horizons.assign(rmse_deg=np.where(horizons["predictor"] == HOLD, 7.0, np.inf))
    assert f"({HOLD}) by 7.0 deg" in tell_horizons(overflowing, "base")
    figure = draw_horizons(horizons, {"noise": 0.5}, NO_NETWORKS, "base")
    assert any("base (overflows" in text.get_text() for text in figure.legends[0].get_texts())


def test_trials_too_short_for_a_window_or_a_horizon_are_said_to_be(tell_torque, tell_horizons):
    torque = torque_of(np.nan, np.nan, np.nan)
    assert "too short" in tell_torque(torque, "base") and draw_torque(torque).axes
    assert "too short" in tell_horizons(SHORT, "base")
    assert draw_horizons(SHORT, {"noise": 0.5}, NO_NETWORKS, "base").axes


def test_a_picture_says_what_it_shows_beside_the_best_rival(facts):
    rows = [("base", True, 0.74), ("base+drag", True, 0.9), (POSTURE, True, 0.95), (EMG_ONLY, True, 0.8)]
    torque = pd.DataFrame([*rows, ("base", False, 0.2), (NOISE, True, 1.0)], columns=["model", "held_out", "r2"])
    errors = [("base", np.inf), (POSTURE, 6.0), (EMG_ONLY, 5.0), (HOLD, 9.0), (SAME_SPEED, 8.0)]
    horizons = pd.DataFrame([(name, 0.5, True, error) for name, error in errors], columns=SHORT.columns)
    rmse = {name: {"train": 1.0, "heldout": 1.0, "noise": 0.5} for name in ("base", "base+drag")}
    found = {"model": "base+drag", "rmse_deg": rmse}
    explained, ahead = findings(facts(**summarize(torque, horizons), **found))
    assert draw_torque(torque, explained).get_suptitle() == (
        "Torque explained: 0.74 by the model, 0.90 with what was found, 0.95 by posture and speed"
    )
    assert draw_horizons(horizons, {"noise": 0.5}, NO_NETWORKS, "base", ahead).get_suptitle() == (
        "Error 0.5 s after a measured state: 5.0 deg by EMG without physics"
    )
    assert findings(facts(**summarize(torque.assign(r2=np.nan), SHORT))) == ("", "")
