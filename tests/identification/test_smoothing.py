"""The smoothed motion of a record, against the motion that was simulated."""

import numpy as np
import pytest

from myowave.identification.smoothing import WIDEST_S, choose_window, smooth


@pytest.mark.parametrize("noise_deg", [0.05, 0.5, 2.0])
def test_more_noise_asks_for_a_wider_window(make_noisy, noise_deg):
    record = make_noisy(noise_deg)
    chosen, less = (choose_window(record.angle, record.dt, np.radians(n)) for n in (noise_deg, noise_deg / 4))
    assert less <= chosen and chosen % 2 == 1
    assert chosen * record.dt < WIDEST_S + 2 * record.dt


@pytest.mark.parametrize("noise_deg", [0.0, 0.1, 0.3, 1.0])
def test_the_window_chosen_is_as_near_to_the_true_motion_as_the_widest(clean, make_noisy, noise_deg):
    true, record = clean.angle, make_noisy(noise_deg)
    widest = choose_window(record.angle, record.dt, np.radians(10.0))
    chosen, wide = (
        np.sqrt(((smooth(record.angle, record.lengths, record.dt, window)[0] - true) ** 2).mean())
        for window in (record.window, widest)
    )
    assert chosen < 1.05 * wide
    assert noise_deg > 0.1 or chosen < 0.5 * wide
