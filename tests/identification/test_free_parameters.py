"""What is estimated: constants that are wanted and all parameters of effects, but nothing that is known."""

import numpy as np

from myowave.identification.free_parameters import bounds, free_parameters, moved, scales, start_values
from myowave.settings import Identify, Scatter


def test_parameters_of_effects_are_estimated_beside_the_constants_and_known_ones_are_not(base, effects):
    model = base.with_effects([effects["joint_damping"], effects["emg_gain"]])
    free = free_parameters(model, {"f0_Bi": Identify(), "l0_Bi": Identify()}, {"l0_Bi", "emg_gain.g_emg_triceps"})
    assert [p.name for p in free] == ["f0_Bi", "joint_damping.c", "emg_gain.g_emg_biceps"]
    assert free[1].start == 0 and free[1].scale == effects["joint_damping"].parameters["c"].typical


def test_an_effect_named_like_a_constant_is_estimated_once_though_the_constant_was_never_measured(base, effects):
    model = base.with_effects([effects["vmax_change"]])
    free = free_parameters(model, {}, (), {"vmax": Scatter(absolute=0.5)})
    assert [p.name for p in free] == [*(f"vmax_{m.name}" for m in model.muscles), "vmax_change.r"]


def test_bounds_come_from_the_settings_for_constants_and_from_the_file_of_an_effect(base, effects):
    model, damping = base.with_effects([effects["joint_damping"]]), effects["joint_damping"].parameters["c"]
    free = free_parameters(model, {"f0_Bi": Identify(low=310.0, high=340.0)}, ())
    assert [(p.low, p.high) for p in free] == [(310.0, 340.0), (damping.low, damping.high)]
    assert free[0].start == 310.0, "the model's value lies outside"


def test_literature_values_bound_from_above_by_their_mean(base):
    (p,) = free_parameters(base, {"f0_Bi": Identify(literature=(100.0, 300.0))}, ())
    assert p.high == 200.0 and 0 < p.low < p.start == 200.0


def test_starts_depend_on_the_seed_and_stay_in_the_spread(base, free):
    values, spread = start_values(free, range(20)), np.array([p.spread for p in free])
    error = np.abs(values / [p.start for p in free] - 1)
    assert (error <= spread + 1e-12).all() and (error.max(0) > 0.5 * spread).all()
    one = next(i for i, p in enumerate(free) if p.name == "l0_Tri")
    assert start_values(free[one : one + 1], [7]).item() == values[7, one], "not what else is estimated counts"


def test_a_step_moves_positive_constants_by_a_factor_and_stays_within_bounds(base, effects):
    free = free_parameters(base.with_effects([effects["joint_damping"]]), {"f0_Bi": Identify()}, ())
    values = np.array([300.0, 0.5])
    there = moved(free, values, np.array([0.1, 0.2]))
    np.testing.assert_allclose(there, [300.0 * np.exp(0.1), 0.5 + 0.2 * scales(free)[1]])
    np.testing.assert_allclose(moved(free, there, np.array([-0.1 * np.exp(0.1), -0.2])), values)
    low, high = bounds(free)
    for far in (np.full(2, 1e6), np.full(2, -1e6)):
        assert ((moved(free, values, far) >= low) & (moved(free, values, far) <= high)).all()
