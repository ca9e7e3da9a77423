"""Wavelet scales: exact projections everywhere, PyWavelets' own inside, and no jump at the ends."""

import numpy as np
import pytest
import pywt
from hypothesis import given, settings
from hypothesis import strategies as st

from myowave.data.wavelets import decompose, max_level, project

EXACT = 1e-12
wavelets = st.sampled_from(["db1", "db2", "db3", "db4"])
any_length = st.integers(min_value=24, max_value=300)
seeds = st.integers(min_value=0, max_value=2**32 - 1)


def noise(samples, seed):
    return np.random.default_rng(seed).standard_normal(samples)


def levels_of(samples, wavelet):
    return range(1, max_level(samples, wavelet) + 1)


@settings(deadline=None, max_examples=40)
@given(samples=any_length, seed=seeds, wavelet=wavelets)
def test_projecting_twice_changes_nothing(samples, seed, wavelet):
    signal = noise(samples, seed)
    for level in levels_of(samples, wavelet):
        once = project(signal, level, wavelet)
        assert np.abs(project(once, level, wavelet) - once).max() < EXACT


@settings(deadline=None, max_examples=40)
@given(samples=any_length, seed=seeds, wavelet=wavelets)
def test_the_spaces_are_nested(samples, seed, wavelet):
    """A coarser scale is the same from any finer one, and lies in all of them."""
    signal = noise(samples, seed)
    for coarse in levels_of(samples, wavelet):
        expected = project(signal, coarse, wavelet)
        for fine in range(coarse):
            assert np.abs(project(project(signal, fine, wavelet), coarse, wavelet) - expected).max() < EXACT
            assert np.abs(project(expected, fine, wavelet) - expected).max() < EXACT


@settings(deadline=None, max_examples=40)
@given(samples=any_length, seed=seeds, wavelet=wavelets)
def test_details_are_orthogonal_to_every_coarser_scale(samples, seed, wavelet):
    """So the energies of the coarsest scale and of all details add up to that of the signal (Parseval)."""
    signal, other = noise(samples, seed), noise(samples, seed + 1)
    scales = [signal, *(project(signal, level, wavelet) for level in levels_of(samples, wavelet))]
    details = [fine - coarse for fine, coarse in zip(scales[:-1], scales[1:], strict=True)]
    for level, detail in enumerate(details, start=1):
        assert abs(detail @ project(other, level, wavelet)) < 1e-10
    energy = scales[-1] @ scales[-1] + sum(detail @ detail for detail in details)
    assert energy == pytest.approx(signal @ signal, rel=EXACT)


@settings(deadline=None, max_examples=30)
@given(samples=st.integers(min_value=120, max_value=400), seed=seeds)
def test_a_scale_is_the_coarser_one_plus_its_wavelets(samples, seed):
    """Eq. 27 with the wavelet coefficients T_k that PyWavelets finds, where these do not see the ends."""
    signal, deepest = noise(samples, seed), 3
    for level in range(1, deepest + 1):
        coefficients = pywt.wavedec(signal, "db2", mode="symmetric", level=level)
        empty = [np.zeros_like(c) for c in coefficients]
        details = pywt.waverec([empty[0], coefficients[1], *empty[2:]], "db2", mode="symmetric")[:samples]
        rebuilt = project(signal, level) + details
        inner = slice(6 * 2**level, -6 * 2**level)
        assert np.abs(rebuilt - project(signal, level - 1))[inner].max() < EXACT


@settings(deadline=None, max_examples=30)
@given(samples=st.integers(min_value=200, max_value=400), seed=seeds, wavelet=st.sampled_from(["db1", "db2", "db3"]))
def test_inside_it_is_the_projection_of_pywavelets(samples, seed, wavelet):
    signal = noise(samples, seed)
    for level in (1, 2, 3):
        coarsest, *details = pywt.wavedec(signal, wavelet, mode="symmetric", level=level)
        expected = pywt.waverec([coarsest, *(np.zeros_like(d) for d in details)], wavelet, mode="symmetric")[:samples]
        reach = 2 * (pywt.Wavelet(wavelet).dec_len - 1) * 2**level
        inner = slice(reach, -reach)
        assert np.abs(project(signal, level, wavelet) - expected)[inner].max() < EXACT


@settings(deadline=None, max_examples=30)
@given(samples=any_length, slope=st.floats(-10, 10), offset=st.floats(-10, 10))
def test_a_straight_line_comes_through_to_the_last_sample(samples, slope, offset):
    line = offset + slope * np.linspace(0, 1, samples)
    for level in levels_of(samples, "db2"):
        assert np.abs(project(line, level) - line).max() < 1e-11


def drifting_motion(samples=500, draws=20):
    random = np.random.default_rng(4)
    time = np.linspace(0, 15.8, samples)[:, None]
    frequency, phase = random.uniform(0.2, 0.5, draws), random.uniform(0, 6.3, draws)
    return 0.7 + 0.3 * np.sin(2 * np.pi * frequency * time + phase) + random.normal(0, 0.03, draws) * time


@pytest.mark.parametrize("level", [1, 2, 3])
def test_the_ends_of_a_drifting_motion_are_as_good_as_its_middle(level):
    motion = drifting_motion()
    error = project(motion, level) - motion
    ends, middle = np.r_[error[:8], error[-8:]], error[40:-40]
    assert np.sqrt((ends**2).mean()) < 1.3 * np.sqrt((middle**2).mean())
    coarsest, *details = pywt.wavedec(motion, "db2", mode="periodization", level=level, axis=0)
    empty = [np.zeros_like(d) for d in details]
    wrapped = pywt.waverec([coarsest, *empty], "db2", mode="periodization", axis=0)[: len(motion)] - motion
    assert np.abs(ends).max() < 0.1 * np.abs(np.r_[wrapped[:8], wrapped[-8:]]).max()


def test_channels_are_projected_each_by_itself():
    signals = noise((100, 3), 0)
    together = project(signals, 2)
    for c in range(3):
        assert np.abs(together[:, c] - project(signals[:, c], 2)).max() < EXACT


def test_padding_never_reaches_a_shorter_trial(trials):
    together = decompose(trials, 3)
    alone = decompose(trials.select(["short"]), 3)
    for level in range(4):
        assert (together[level].angle[0, :80] == alone[level].angle[0]).all()
        assert (together[level].emg[0, :80] == alone[level].emg[0]).all()


def test_each_scale_is_the_projection_of_its_level(trials):
    for level, coarse in decompose(trials, 3).items():
        for i, length in enumerate(trials.lengths):
            np.testing.assert_array_equal(coarse.angle[i, :length], project(trials.angle[i, :length], level))
            np.testing.assert_array_equal(coarse.emg[i, :length], project(trials.emg[i, :length], level))


def test_scale_0_is_the_recording(trials):
    finest = decompose(trials, 2)[0]
    assert (finest.emg == trials.emg).all() and (finest.angle == trials.angle).all()


def test_coarser_scales_vary_more_slowly(trials):
    roughness = [np.abs(np.diff(t.angle[1])).mean() for t in decompose(trials, 4).values()]
    assert roughness == sorted(roughness, reverse=True)


def test_too_many_scales_are_refused_with_the_trial_and_what_it_allows(trials):
    assert decompose(trials, 4)[4].lengths == trials.lengths
    with pytest.raises(ValueError, match="trial 'short': level 5 is asked of 80 samples; expected 0 to 4.*96 samples"):
        decompose(trials, 5)


def test_the_shortest_signal_a_level_allows_is_projected():
    for level in range(1, 6):
        signal = noise(3 * 2**level, level)
        assert max_level(len(signal)) == level
        assert np.isfinite(project(signal, level)).all()


def test_what_belongs_to_the_trials_stays_at_every_scale(trials):
    for coarse in decompose(trials, 2).values():
        for field in ("dataset", "dt", "names", "channels", "lengths", "test", "conditions", "constants"):
            assert getattr(coarse, field) == getattr(trials, field)
