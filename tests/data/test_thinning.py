"""Trials at a lower rate: whole samples as recorded, of every signal alike, and scales of their own."""

import numpy as np
import pytest

from myowave.data.trials import Trials
from myowave.data.wavelets import decompose, thin_scales


@pytest.fixture
def trials() -> Trials:
    random = np.random.default_rng(0)
    lengths = (200, 121)
    return Trials.from_sequences(
        dataset="d",
        dt=0.01,
        names=("a", "b"),
        channels=("emg_biceps",),
        emg=[random.random((n, 1)) for n in lengths],
        angle=[random.normal(size=n) for n in lengths],
        signals={"tilt_rad": [random.normal(size=n) for n in lengths]},
        over_time={"tilt": "tilt_rad"},
        test=("b",),
        conditions={"a": {"load": 1.0}},
    )


def test_every_fourth_sample_is_kept_of_all_signals_and_time_goes_on_as_it_was(trials):
    thinned = trials.thinned(25.0)
    assert thinned.dt == pytest.approx(0.04) and thinned.lengths == (50, 31)
    for t, length in enumerate(trials.lengths):
        kept = slice(0, length, 4)
        samples = slice(0, thinned.lengths[t])
        np.testing.assert_array_equal(thinned.emg[t, samples], trials.emg[t, kept])
        np.testing.assert_array_equal(thinned.angle[t, samples], trials.angle[t, kept])
        np.testing.assert_array_equal(thinned.signals["tilt_rad"][t, samples], trials.signals["tilt_rad"][t, kept])
        np.testing.assert_allclose(thinned.time[samples], trials.time[kept])
    assert (thinned.test, thinned.conditions, thinned.over_time) == (trials.test, trials.conditions, trials.over_time)


@pytest.mark.parametrize("rate", [None, 100.0, 70.0, 500.0])
def test_trials_that_have_no_more_samples_than_asked_for_stay_as_they_are(trials, rate):
    assert trials.thinned(rate) is trials


def test_scales_of_thinned_trials_are_those_of_what_is_left(trials):
    scales = decompose(trials, 2)
    assert thin_scales(scales, None, 2, "db2") is scales
    thinned, expected = thin_scales(scales, 25.0, 1, "db2"), decompose(trials.thinned(25.0), 1)
    assert set(thinned) == {0, 1}
    for level in thinned:
        np.testing.assert_array_equal(thinned[level].angle, expected[level].angle)


def test_a_rate_that_leaves_one_sample_of_a_trial_is_refused(trials):
    with pytest.raises(ValueError, match=r"trial 'b': of 121 samples 100 a second, 0\.6 a second leave one\..*rate_hz"):
        trials.thinned(0.6)
