"""Predictors without physics: they learn what they can, from training trials and the past alone."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.data.trials import Trials
from myowave.identification.record import make_record
from myowave.learning import baselines
from myowave.learning.baselines import predict_baseline, score_baseline
from myowave.learning.task import fresh_network
from myowave.physics.model import Model
from myowave.settings import Baseline

KINDS = ("hold", "ridge", "trees", "gru", "convolution")


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    short = dict.fromkeys(baselines.PIECE_S, 2.0)
    for name, value in {"STEPS": 40, "STEP_S": (8.0, 8.0), "PIECE_S": short, "GAIN": 0.0}.items():
        monkeypatch.setattr(baselines, name, value)


@pytest.fixture(scope="module")
def late():
    """Four trials in which the angle is the EMG of 0.2 s before; the last tests."""
    random = np.random.default_rng(0)
    emg = np.abs(np.cumsum(random.standard_normal((4, 150, 1)), axis=1)) / 30
    angle = 0.5 + np.concatenate([emg[:, :1].repeat(5, 1), emg[:, :-5]], axis=1)[..., 0]
    return Trials("late", 0.04, ("1", "2", "3", "4"), ("emg_biceps",), emg, angle, (150,) * 4, test=("4",))


@pytest.mark.parametrize(("kind", "least"), [("ridge", 0.95), ("trees", 0.5), ("gru", 0.5), ("convolution", 0.9)])
def test_a_baseline_learns_an_angle_that_follows_emg(late, model, kind, least):
    rows = score_baseline(Baseline(kind=kind), late, model, (0, 1), name="rival")
    assert (rows["test_r2"] > least).all() and list(rows["seed"]) == [0, 1] and set(rows["recipe"]) == {"rival"}


def test_hold_is_the_last_given_angle(late, model):
    held = predict_baseline(Baseline(kind="hold"), late, model, (0,))
    torch.testing.assert_close(held[0, 3, 4:], torch.full((146,), late.angle[3, 3], dtype=held.dtype))


def test_a_test_trial_that_is_too_short_to_be_scored_is_named(late, model):
    lengths = (150, 150, 150, 5)
    parts = ([values[:n] for values, n in zip(of, lengths, strict=True)] for of in (late.emg, late.angle))
    emg, angle = parts
    short = Trials.from_sequences(
        dataset="late", dt=0.04, names=late.names, channels=late.channels, emg=emg, angle=angle, test=("4",)
    )
    with pytest.raises(ValueError, match="test trial '4': 5 samples are too few to score.* the first 4 is given"):
        score_baseline(Baseline(kind="hold"), short, model, (0,), name="rival")


def test_where_all_trials_test_none_is_left_to_train(late, model):
    with pytest.raises(
        ValueError, match="dataset 'late': no trial is left to train or fit; name fewer of them as test"
    ):
        score_baseline(Baseline(kind="hold"), replace(late, test=late.names), model, (0,), name="rival")
    with pytest.raises(ValueError, match="dataset 'late': no trial is left to train or fit"):
        make_record(replace(late, test=late.names), model)


def test_without_emg_a_baseline_or_network_is_refused(late, rollout):
    """As of a machine, which has a motor or nothing that drives it."""
    swings, machine = replace(late, channels=(), emg=late.emg[..., :0]), Model((), {"mass": 1.0, "length": 0.5})
    for ask in (
        lambda: predict_baseline(Baseline(kind="trees"), swings, machine, (0,)),
        lambda: fresh_network(replace(rollout, scales={0: swings}, model=machine)),
    ):
        with pytest.raises(
            ValueError, match=r"dataset 'late': its arm has no muscles.* under targets.without_networks"
        ):
            ask()


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_comes_from_what_is_later_or_from_the_angle_of_a_test_trial(late, model, kind):
    emg, angle = late.emg.copy(), late.angle.copy()
    emg[3, 100:] += 0.3
    angle[3, 4:] = 9.0
    first, other = (
        predict_baseline(Baseline(kind=kind), trials, model, (0,))[0, 3]
        for trials in (late, replace(late, emg=emg, angle=angle))
    )
    torch.testing.assert_close(first[:100], other[:100])
    assert kind == "hold" or (first[100:] - other[100:]).abs().max() > 1e-3


@pytest.mark.parametrize("kind", ("trees", "gru", "convolution"))
def test_seeds_differ_and_do_not_see_each_other(late, model, kind):
    both, alone = (predict_baseline(Baseline(kind=kind), late, model, seeds) for seeds in ((0, 1), (1,)))
    torch.testing.assert_close(both[1], alone[0], rtol=0, atol=1e-4)
    assert (both[0] - both[1]).abs().max() > 1e-3
