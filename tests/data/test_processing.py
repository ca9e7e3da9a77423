"""EMG to excitation and onto a common grid: what the filters do to signals of which the right answer is known."""

import numpy as np
import pytest

from myowave.data.processing.excitation import Known, envelope, known_from
from myowave.data.processing.filters import band_pass, before_low_pass, lag_s, low_pass
from myowave.data.processing.sampled import Sampled, common_grid, sample_at
from myowave.data.processing.units import TO_EMG, TO_RADIANS, plain_unit
from myowave.settings import Processing

RATE = 2000.0
TIME = np.arange(0, 10, 1 / RATE)
PHASES = ("zero", "causal")


def sampled(values, rate=RATE, start=0.0):
    return Sampled(np.asarray(values, dtype=float), rate, start, "uV")


def envelope_of(values, processing):
    """That of a recording of which nothing was known before."""
    return envelope(sampled(values), processing, known_from([sampled(values)], processing)).values


def amplitude(values, frequency, time=TIME):
    """Amplitude of a frequency, in the middle of a signal, from its Fourier sum."""
    middle = slice(len(values) // 4, 3 * len(values) // 4)
    return 2 * abs(np.mean(values[middle] * np.exp(-2j * np.pi * frequency * time[middle])))


def through_filter(apply, frequency, time=TIME):
    """What a filter leaves of a sine."""
    return apply(np.sin(2 * np.pi * frequency * time)[:, None])[:, 0]


def modulated(depth=0.8, slow=0.5, carrier=100.0, delay=0.0):
    """A carrier of which the strength goes up and down slowly, and its true mean rectified value."""
    strength = 1 + depth * np.sin(2 * np.pi * slow * (TIME - delay))
    return strength * np.sin(2 * np.pi * carrier * TIME), strength * 2 / np.pi


# ------------------------------------------------------------------------------------------------------- filters


@pytest.mark.parametrize("phase", PHASES)
def test_at_its_corner_a_low_pass_leaves_half_the_power_however_often_it_runs(phase):
    for corner in (4.0, 10.0):
        through = through_filter(low_pass(RATE, corner, phase), corner)
        assert amplitude(through, corner) == pytest.approx(np.sqrt(0.5), rel=2e-3)


def test_noise_before_a_low_pass_has_the_effect_that_drawn_noise_has_behind_it():
    """Its variance is 1 there, so is what a single sample sees of it; two, half a period apart, see nearly the same."""
    rate, corner = 100.0, 4.0
    passed = low_pass(rate, corner, "zero")(np.random.default_rng(1).standard_normal((200_000, 1)))[:, 0]
    passed /= passed.std()
    answers = np.zeros((30, 3))
    answers[0, 0] = answers[[3, 9], 1] = answers[:, 2] = 1.0
    found = before_low_pass(answers, rate, corner)
    windows = np.lib.stride_tricks.sliding_window_view(passed, 30)
    np.testing.assert_allclose(found.T @ found, np.cov((windows @ answers).T), rtol=0.02)
    assert (found[:, 0] ** 2).sum() == pytest.approx(1.0)


@pytest.mark.parametrize("phase", PHASES)
def test_at_both_ends_of_its_band_a_band_pass_leaves_half_the_power(phase):
    for end in (20.0, 450.0):
        through = through_filter(band_pass(RATE, (20.0, 450.0), phase), end)
        assert amplitude(through, end) == pytest.approx(np.sqrt(0.5), rel=2e-3)
    assert amplitude(through_filter(band_pass(RATE, (20.0, 450.0), phase), 100), 100) > 0.99
    assert amplitude(through_filter(band_pass(RATE, (20.0, 450.0), phase), 2), 2) < 0.01


def test_a_band_that_the_rate_cannot_hold_is_cut_at_0_45_of_it():
    time = np.arange(0, 10, 1 / 500)
    through = through_filter(band_pass(500.0, (20.0, 450.0), "causal"), 225, time)
    assert amplitude(through, 225, time) == pytest.approx(np.sqrt(0.5), rel=2e-3)


def test_hum_is_taken_out_where_there_is_a_line_and_noise_without_one_stays_as_it_is():
    noise = np.random.default_rng(1).standard_normal(len(TIME))
    hum = noise + 2 * np.sin(2 * np.pi * 50 * TIME)
    kept, asked = (envelope_of(noise, Processing(notch_hz=f)) for f in (None, 50.0))
    assert np.array_equal(kept, asked)
    left, without = (envelope_of(hum, Processing(notch_hz=f)) for f in (None, 50.0))
    assert without.mean() == pytest.approx(kept.mean(), rel=0.02) and left.mean() > 1.4 * kept.mean()


def test_the_lag_of_second_order_at_4_hz_is_56_ms():
    assert lag_s(4.0) == pytest.approx(0.0563, abs=1e-4)


# ------------------------------------------------------------------------------------------------------- envelope


def shift_between(late, early):
    """Time [s] by which one slow signal comes after another, from where their correlation is largest."""
    late, early = late - late.mean(), early - early.mean()
    lags = range(-300, 301)
    middle = slice(2000, len(TIME) - 2000)
    best = max(lags, key=lambda k: float(np.dot(np.roll(early, k)[middle], late[middle])))
    return best / RATE


def test_a_modulated_carrier_gives_its_modulation_back_without_lag():
    raw, truth = modulated()
    found = envelope_of(raw, Processing())
    inside = slice(1000, -1000)
    assert np.abs(found - truth)[inside].max() < 0.01 * truth.max()
    assert abs(shift_between(found, truth)) <= 1 / RATE


def test_a_causal_envelope_comes_later_by_what_is_stated():
    raw, truth = modulated()
    settings = Processing(phase="causal")
    found = envelope_of(raw, settings)
    # The band-pass lags as well, at 100 Hz by milliseconds.
    assert shift_between(found, truth) == pytest.approx(lag_s(settings.low_pass_hz), abs=0.012)


def test_a_causal_envelope_knows_nothing_of_what_comes_later():
    raw = np.random.default_rng(2).standard_normal(len(TIME))
    settings = Processing(phase="causal", band_pass_hz=None)
    changed = np.where(TIME < 6, raw, 10 * raw)
    changed += np.median(raw) - np.median(changed)  # the offset is taken from the whole
    before = TIME < 6
    one, other = (envelope_of(x, settings) for x in (raw, changed))
    assert np.abs(one - other)[before].max() < 0.02 * one.max() < np.abs(one - other)[~before].max()


def test_a_burst_of_noise_comes_back_at_its_time_with_its_height():
    noise = np.random.default_rng(3).standard_normal(len(TIME))
    raw = noise * np.where((TIME > 4) & (TIME < 6), 30.0, 1.0)
    found = envelope_of(raw, Processing(band_pass_hz=(20.0, 900.0)))
    inside, outside = found[(TIME > 4.3) & (TIME < 5.7)], found[(TIME < 3.5) | (TIME > 6.5)]
    assert inside.mean() == pytest.approx(30 * np.sqrt(2 / np.pi), rel=0.1)  # mean |x| of normal noise
    assert outside.max() < 0.1 * inside.min()
    half = TIME[found > inside.mean() / 2]
    assert half[0] == pytest.approx(4, abs=0.05) and half[-1] == pytest.approx(6, abs=0.05)


@pytest.mark.parametrize("phase", PHASES)
def test_gain_and_offset_of_the_amplifier_make_no_difference_but_in_scale(phase):
    raw, _ = modulated()
    settings = Processing(phase=phase)
    once, tripled = envelope_of(raw, settings), envelope_of(3 * raw + 500, settings)
    assert np.allclose(tripled, 3 * once, rtol=1e-6, atol=1e-6)
    assert once.min() >= 0


# ------------------------------------------------------------------------------------------------ grid and units


def test_the_grid_is_where_all_signals_were_recorded():
    angle = sampled(np.zeros(400), rate=100.0, start=1.0)  # 1 to 4.99 s
    emg = sampled(np.zeros(8000), start=0.2505)  # 0.2505 to 4.25 s
    grid = common_grid([angle, emg], angle, 50.0, None)
    assert grid[0] == 1.0 and grid[-1] <= emg.end < grid[-1] + 0.02 and np.allclose(np.diff(grid), 0.02)
    cut = common_grid([angle, emg], angle, None, (1.5, 3.0))
    assert cut[0] == pytest.approx(1.5) and cut[-1] == pytest.approx(3.0) and np.allclose(np.diff(cut), 0.01)


def test_at_its_own_rate_a_signal_keeps_its_samples():
    values = np.random.default_rng(4).standard_normal(400)
    angle = sampled(values, rate=100.0, start=0.3)
    assert np.array_equal(sample_at(angle, common_grid([angle], angle, None, (1.3, 3.3))), values[100:301])


def test_a_slow_signal_is_followed_between_its_samples_and_before_a_coarser_grid():
    def angle(t):
        return np.sin(2 * np.pi * 1.5 * t + 0.3)

    time = np.arange(0.5, 9.5, 0.01) + 0.0037
    for rate in (60.0, 148.15, 200.0, 2000.0):
        source = sampled(angle(np.arange(0, 10, 1 / rate)), rate=rate)
        assert np.abs(sample_at(source, time) - angle(time)).max() < 2e-3


def test_what_a_coarser_grid_cannot_hold_does_not_come_back_as_something_else():
    fast = np.sin(2 * np.pi * 95 * TIME)  # at 100 Hz it would look like 5 Hz
    taken = sample_at(sampled(fast), np.arange(0.5, 9.5, 0.01))
    assert np.abs(taken).max() < 0.01


def test_units_are_converted():
    assert 180 * TO_RADIANS["deg"] == pytest.approx(np.pi)
    for written, volts in (("V", 1.0), ("mV", 1e3), ("µV", 1e6), ("μV", 1e6), ("Volts", 1.0), ("[uV]", 1e6)):
        assert volts * TO_EMG[plain_unit(written)] == pytest.approx(1e6)
    spelt = {"Deg": "deg", "sec": "s", "S": "s", "MV": "mV", "Msec": "ms"}
    assert {written: plain_unit(written) for written in spelt} == spelt


def test_a_causal_envelope_starts_at_the_mean_of_its_first_lag_and_not_at_its_first_sample():
    values = np.tile([1.0, -1.0], 500)
    values[0] = 5.0
    processing = Processing(phase="causal", band_pass_hz=None, low_pass_hz=4.0)
    known = Known(form="raw", rate_hz=1000.0, unit="V")
    started = envelope(Sampled(values, 1000.0, 0.0, "V"), processing, known).values
    assert started[0] == pytest.approx(1 + 4 / 56, abs=0.005)  # one sample of 5 in 56 ms of 1
