"""The excitation to expect behind a noisy recording."""

import numpy as np
import pytest
import torch

from myowave.data.processing.filters import before_low_pass, low_pass
from myowave.identification.expected_emg import behind_noise, expected_excitation

SAMPLES, NOISE = 600, 0.05


@pytest.fixture(scope="module")
def excitation():
    """Slow bursts, and what wanders from sample to sample around them, of three trials: (3, N, 2)."""
    random = np.random.default_rng(0)
    time = np.arange(SAMPLES) * 0.03
    phase = random.uniform(0, 6, (3, 1, 2))
    return 0.5 + 0.15 * np.sin(2.0 * time[None, :, None] + phase) + 0.05 * random.standard_normal((3, SAMPLES, 2))


@pytest.fixture(scope="module")
def recorded(excitation):
    return excitation + NOISE * np.random.default_rng(1).standard_normal(excitation.shape)


EVERYWHERE = np.ones((3, SAMPLES), bool)


def slope(of, on, slow):
    """How what is fast in one signal goes with what is fast in another."""
    one, other = (of - slow).ravel(), (on - slow).ravel()
    return float(one @ other / (other @ other))


def test_the_truth_goes_with_what_is_expected_as_one_to_one(excitation, recorded):
    """As it does not with what was recorded, which is why estimates from a recording are off."""
    expected = expected_excitation(recorded, EVERYWHERE, NOISE)
    slow = expected_excitation(excitation, EVERYWHERE, 1e3)
    assert slope(excitation, recorded, slow) < 0.6
    assert slope(excitation, expected, slow) == pytest.approx(1.0, abs=0.1)


def test_it_is_nearer_to_the_truth_than_the_recording(excitation, recorded):
    error = expected_excitation(recorded, EVERYWHERE, NOISE) - excitation
    assert np.sqrt((error**2).mean()) < 0.8 * NOISE


def test_a_recording_without_noise_stays_as_it_is(recorded):
    np.testing.assert_allclose(expected_excitation(recorded, EVERYWHERE, 0.0), recorded, atol=1e-12)


def test_noise_that_passed_a_low_pass_is_taken_off_where_it_is(excitation):
    """What is faster than the low-pass lets through is no noise."""
    noise = low_pass(1.0, 0.04, "zero")(np.random.default_rng(1).standard_normal((3 * SAMPLES, 2))).reshape(3, -1, 2)
    recorded = excitation + NOISE * noise / noise.std()
    passed = before_low_pass(np.ones(1), 1.0, 0.04)
    white, known = (expected_excitation(recorded, EVERYWHERE, NOISE, how) for how in (np.ones(1), passed))
    of_white, of_known = (np.sqrt(((found - excitation) ** 2).mean()) for found in (white, known))
    assert of_known < 0.9 * NOISE and of_known < 0.9 * of_white


def test_effort_beyond_a_maximum_contraction_is_not_cut_off(recorded):
    stronger = 1.5 * recorded
    found = expected_excitation(stronger, EVERYWHERE, 0.01)
    assert stronger.max() > 1.2 and found.max() > 1.1


def test_padding_is_left_alone_and_a_few_samples_are_not_filtered(recorded):
    valid = EVERYWHERE.copy()
    valid[1, 300:] = False
    padded = np.where(valid[..., None], recorded, 9.0)
    found = expected_excitation(padded, valid, NOISE)
    assert (found[1, 300:] == 9.0).all() and found[valid].max() <= 1.0
    few = recorded[:, :12]
    np.testing.assert_array_equal(expected_excitation(few, EVERYWHERE[:, :12], NOISE), few)


def test_pieces_are_cut_from_trials_whose_noise_is_taken_off_as_well(make_noisy):
    whole = make_noisy(0.1)
    found = behind_noise(whole.cut(1.0), 0.02)
    np.testing.assert_array_equal(found.whole.emg, behind_noise(whole, 0.02).emg)
    assert not torch.equal(found.emg, whole.cut(1.0).emg) and not torch.equal(found.whole.emg, whole.emg)
    assert behind_noise(whole, 0.02).pieces is None


def test_one_more_sample_of_a_short_trial_changes_little_in_the_others(recorded):
    found = []
    for few in (16, 17):
        valid = EVERYWHERE.copy()
        valid[2, few:] = False
        found.append(expected_excitation(recorded, valid, NOISE)[:2])
    assert np.abs(found[0] - found[1]).max() < 0.05 * NOISE


def test_half_the_sampling_rate_has_its_share_of_noise():
    """Of white excitation, half of which is noise, as much is kept there as at other frequencies."""
    recorded = 0.5 + 0.05 * np.random.default_rng(3).standard_normal((4, 2048, 1))
    kept = expected_excitation(recorded, np.ones((4, 2048), bool), 0.05 / np.sqrt(2))
    before, after = (np.fft.rfft(x[..., 0]) for x in (recorded, kept))
    middle, highest = slice(256, 768), slice(-4, None)
    one, other = (
        (after * before.conj())[:, f].real.sum() / (np.abs(before[:, f]) ** 2).sum() for f in (middle, highest)
    )
    assert other == pytest.approx(one, rel=0.15)
