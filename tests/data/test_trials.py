"""Trials: stacking, selecting, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from myowave.data.trials import Trials


def test_shorter_trials_hold_their_last_value_and_are_marked(trials):
    assert trials.emg.shape == (2, 123, 2)
    assert trials.valid.sum(axis=1).tolist() == [80, 123]
    assert (trials.angle[0, 80:] == trials.angle[0, 79]).all()
    assert (trials.emg[0, 80:] == trials.emg[0, 79]).all()


def test_train_and_test_share_the_trials(trials):
    assert trials.train == ("short",)
    assert sorted((*trials.train, *trials.test)) == sorted(trials.names)


def test_selecting_keeps_what_belongs_to_the_selected_and_cuts_the_padding(trials):
    short = trials.select(["short"])
    assert short.angle.shape == (1, 80)
    assert short.test == () and short.conditions == {}
    assert short.valid.all()
    turned = trials.select(["long", "short"])
    assert (turned.angle == trials.angle[::-1]).all()
    assert turned.test == ("long",) and turned.lengths == (123, 80)


def test_a_condition_overrides_a_constant_and_a_constant_the_default(trials):
    assert trials.condition("load", 0.0).tolist() == [0.0, 1.0]
    assert trials.condition("mass", 1.0).tolist() == [1.1, 1.1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"names": ("same", "same"), "test": (), "conditions": {}}, "more than once"),
        ({"test": ("third",)}, r"test: no trial named \['third'\]; the trials are \['short', 'long'\]"),
        ({"conditions": {"third": {"load": 1.0}}}, "conditions: no trial named"),
        ({"channels": ("biceps", "emg_triceps")}, "do not begin with 'emg_'"),
        ({"channels": ("emg_biceps",)}, r"emg has shape \(2, 123, 2\), expected \(2, 123, 1\)"),
        ({"lengths": (80, 100)}, r"expected \(2, 100, 2\)"),
        ({"lengths": (70, 123)}, "do not hold the last value"),
        ({"dt": 0.0}, "dt is 0.0"),
        ({"dt": float("nan")}, "dt is nan"),
    ],
)
def test_inconsistent_trials_are_refused(trials, change, message):
    with pytest.raises(ValueError, match=message):
        replace(trials, **change)


@pytest.mark.parametrize("signal", ["emg", "angle"])
def test_a_number_that_is_not_finite_is_refused_with_its_trial(trials, signal):
    values = getattr(trials, signal).copy()
    values[1, 5] = np.nan
    with pytest.raises(ValueError, match="trial 'long'.*not finite"):
        replace(trials, **{signal: values})


def test_sequences_that_do_not_match_are_refused():
    with pytest.raises(ValueError, match="equally long"):
        Trials.from_sequences(
            dataset="arm", dt=0.01, names=["1"], channels=["emg_a"], emg=[np.zeros((5, 1))], angle=[np.zeros(6)]
        )


def test_selecting_an_unknown_trial_names_those_there_are(trials):
    with pytest.raises(ValueError, match=r"no trial named \['other'\]; the trials are \['short', 'long'\]"):
        trials.select(["other"])


def test_changed_trials_keep_all_but_their_signals_and_hold_their_own_last_values():
    lean = {"tilt_rad": [np.arange(4.0), np.arange(6.0)]}
    trials = Trials.from_sequences(
        dataset="two", dt=0.1, names=("a", "b"), channels=("emg_x",), test=("b",), conditions={"a": {"tilt": 1.5}},
        emg=[np.ones((4, 1)), np.ones((6, 1))], angle=[np.arange(4.0), np.arange(6.0)], signals=lean,
        over_time={"tilt": "tilt_rad"},
    )  # fmt: skip
    halved = trials.changed(lambda values: 3.0 * values[::2], dt=0.2)
    assert halved.dt == 0.2 and halved.lengths == (2, 3) and halved.over_time == trials.over_time
    assert (halved.names, halved.test, halved.conditions) == (trials.names, trials.test, trials.conditions)
    for values in (halved.angle, halved.signals["tilt_rad"]):
        np.testing.assert_array_equal(values, [[0.0, 6.0, 6.0], [0.0, 6.0, 12.0]])
    assert (halved.emg == 3.0).all()
