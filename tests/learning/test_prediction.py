"""Free running: a stream gives what the batch gives, and nothing of the future or of the measured angle leaks in."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.learning.inputs import to_tensors
from myowave.learning.prediction import predict_free_running
from myowave.learning.streaming.predictor import Predictor
from myowave.learning.training import train_scale


@pytest.fixture(params=["rollout", "teacher_forced"])
def checkpoint(request):
    *_, last = train_scale(request.getfixturevalue(request.param), level=0)
    return last.checkpoint


def test_a_stream_gives_what_the_batch_gives(checkpoint, trials):
    network = checkpoint.network
    emg, angle = to_tensors(trials.select(["3"]), torch.device("cpu"))
    batch = predict_free_running(network, emg, angle, trials.dt)[:, 0]
    predictor, samples = Predictor(checkpoint), zip(emg[0].numpy(), angle[0].tolist(), strict=True)
    stream = np.stack([predictor.step(sample, angle=given) for sample, given in samples], axis=-1)
    np.testing.assert_allclose(stream, batch, rtol=0, atol=1e-9)


def test_one_seed_streams_as_among_all(checkpoint, trials):
    every, one = Predictor(checkpoint), Predictor(checkpoint, seeds=[1])
    for sample in trials.emg[2, :30]:
        among, alone = (predictor.step(sample, angle=0.5) for predictor in (every, one))
        np.testing.assert_allclose(alone[0], among[1], rtol=0, atol=1e-9)


def test_prediction_reads_no_later_angle_and_no_later_emg(checkpoint, trials):
    network = checkpoint.network
    emg, angle = to_tensors(trials, torch.device("cpu"))
    whole = predict_free_running(network, emg, angle, trials.dt)
    cut = 100
    emg[:, cut:] = 0.9
    angle[:, network.history :] = 0.0
    changed = predict_free_running(network, emg, angle, trials.dt)
    torch.testing.assert_close(changed[..., :cut], whole[..., :cut], rtol=0, atol=0)
    assert (changed[..., cut:] - whole[..., cut:]).abs().max() > 1e-6


def test_a_carried_state_comes_from_measured_and_predicted_angles_alike(rollout, trials):
    *_, last = train_scale(replace(rollout, seeds=(0,)), level=0)
    network = last.checkpoint.network
    emg, angle = to_tensors(trials, torch.device("cpu"))
    whole = predict_free_running(network, emg, angle, trials.dt)
    later = predict_free_running(
        replace(network, architecture=replace(network.architecture, history=60)), emg, whole[0], trials.dt
    )
    torch.testing.assert_close(later, whole, rtol=0, atol=1e-4)


def test_a_stream_refuses_wrong_input(checkpoint):
    with pytest.raises(ValueError, match="no seed"):
        Predictor(checkpoint, seeds=[9])
    with pytest.raises(ValueError):
        Predictor(checkpoint).step([0.1], angle=0.5)


def test_emg_of_more_effort_than_any_training_trial_is_answered(checkpoint, trials):
    """Light loads train, and a heavy one is predicted."""
    running = Predictor(checkpoint)
    assert np.isfinite([running.step(4 * sample, angle=0.5) for sample in trials.emg[2, :20]]).all()


def test_what_a_filter_leaves_below_0_is_0_as_in_the_import(checkpoint, trials):
    low, zero = Predictor(checkpoint), Predictor(checkpoint)
    for biceps, _ in trials.emg[2, :20]:
        np.testing.assert_array_equal(low.step([biceps, -0.02], angle=0.5), zero.step([biceps, 0.0], angle=0.5))


@pytest.mark.parametrize("value", [-0.2, 5.1, float("nan")])
def test_emg_that_is_not_normalised_is_refused_and_does_not_count(checkpoint, trials, value):
    spoilt, clean = Predictor(checkpoint), Predictor(checkpoint)
    for i, sample in enumerate(trials.emg[2, :20]):
        if i == 10:
            with pytest.raises(ValueError, match="sample 11: emg_triceps is .*, expected 0 to 5"):
                spoilt.step([sample[0], value])
        np.testing.assert_array_equal(spoilt.step(sample, angle=0.5), clean.step(sample, angle=0.5))
