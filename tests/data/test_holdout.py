"""Validation data cut from the training trials: complete, in order, and without the test trial."""

import numpy as np
import pytest

from myowave.data.holdout import hold_out_ends
from myowave.data.trials import Trials


def trials_with(test_value: float = 0.0) -> Trials:
    """Three trials of different length; `test_value` is all that the test trial holds."""
    random = np.random.default_rng(0)
    lengths = (40, 25, 31)
    angle = [random.normal(size=n) for n in lengths]
    angle[1] = np.full(25, test_value)
    return Trials.from_sequences(
        dataset="d",
        dt=0.03,
        names=("a", "b", "c"),
        channels=("emg_biceps",),
        test=("b",),
        emg=[random.random((n, 1)) for n in lengths],
        angle=angle,
        conditions={"c": {"load": 1.0}, "b": {"load": 2.0}},
        constants={"mass": 1.2},
    )


def test_beginning_and_end_together_are_the_training_trial():
    trials = trials_with()
    cut = hold_out_ends(trials, 0.25)
    assert cut.train == ("a", "c") and cut.test == ("a-end", "c-end")
    for name in trials.train:
        whole = trials.index([name])[0]
        parts = cut.index([name, f"{name}-end"])
        for values in ("emg", "angle"):
            pieces = [getattr(cut, values)[i, : cut.lengths[i]] for i in parts]
            expected = getattr(trials, values)[whole, : trials.lengths[whole]]
            np.testing.assert_array_equal(np.concatenate(pieces), expected)
        assert cut.lengths[parts[1]] == pytest.approx(0.25 * trials.lengths[whole], abs=0.5)


def test_the_test_trial_leaves_no_trace():
    one, other = hold_out_ends(trials_with(0.0), 0.3), hold_out_ends(trials_with(9.0), 0.3)
    np.testing.assert_array_equal(one.angle, other.angle)
    np.testing.assert_array_equal(one.emg, other.emg)
    assert not [name for name in one.names if name.startswith("b")]


def test_both_parts_keep_what_is_known_of_the_trial():
    cut = hold_out_ends(trials_with(), 0.25)
    assert cut.conditions == {"c": {"load": 1.0}, "c-end": {"load": 1.0}}
    assert cut.constants == {"mass": 1.2}


def test_parts_too_short_are_refused():
    with pytest.raises(ValueError, match="at least 2 in each part"):
        hold_out_ends(trials_with(), 0.01)
