"""The balance between kinks vanishes on a true motion and leads to its parameters from wrong starts, in a few steps."""

from dataclasses import replace
from functools import partial
from itertools import islice

import numpy as np
import pytest

from myowave.identification.free_parameters import free_parameters, start_values
from myowave.identification.least_squares import search
from myowave.identification.torque import TorqueBalance, effects_unseen_by_angle
from myowave.settings import Identify


def solve(balance, free, values, steps=8):
    *_, found = islice(search(partial(balance.unmoved, free), free, values, steps), steps)
    return found


def test_the_weak_residual_finds_the_truth_to_a_twentieth_of_a_percent(exact, base, free):
    start = start_values(free, (0, 1))
    truth = np.array([base.defaults[p.name] for p in free])
    assert np.abs(start / truth - 1).max() > 0.05
    assert np.abs(solve(TorqueBalance.between_kinks(base, exact), free, start) / truth - 1).max() < 5e-4


def test_the_residual_of_the_true_motion_is_small_beside_one_of_wrong_parameters(exact, base, free):
    balance = TorqueBalance.between_kinks(base, exact)
    true, wrong = (
        np.abs(balance.unmoved(free, factor * np.array([p.start for p in free]))).max() for factor in (1, 1.1)
    )
    assert true < 0.01 * wrong


def test_a_shorter_trial_is_used_as_far_as_it_goes(exact, base, free):
    valid, angle = exact.valid.copy(), exact.angle.copy()
    valid[1, 150:] = False
    angle[1, 150:] = angle[1, 149]
    balance = TorqueBalance.between_kinks(base, replace(exact, valid=valid, angle=angle))
    truth = np.array([p.start for p in free])
    assert np.abs(solve(balance, free, start_values(free, (0,))) / truth - 1).max() < 5e-4


def test_bounds_hold_where_the_truth_lies_beyond(exact, base):
    free = free_parameters(base, {"f0_Bi": Identify(start_spread=0.0, low=310.0, high=340.0)}, ())
    values = solve(TorqueBalance.between_kinks(base, exact), free, np.array([[325.0]]))
    assert values == pytest.approx(310.0)


def test_effects_that_no_angle_shows_are_named(base, effects):
    model = base.with_effects(effects[name] for name in ("joint_damping", "fatigue", "angle_offset"))
    assert effects_unseen_by_angle(model) == ["fatigue", "angle_offset"]
