"""Noise on the history: what it moves, what it leaves, and that it is another for each seed, scale and epoch."""

import pytest
import torch

from myowave.learning.loss import Noise
from myowave.learning.network import Architecture, Network, Scaling, initialise
from myowave.learning.prediction import to_tensors
from myowave.learning.rollouts.loss import RolloutLoss
from myowave.learning.windows import Corpus

CPU = torch.device("cpu")


@pytest.fixture
def rolled(trials):
    """What gives the loss of rollouts of networks whose output weights are 0, (noise, increments) -> (S,)."""
    seeds, steps, history = range(20), 4, 3

    def roll(noise, increments):
        architecture = Architecture("gru", 6, 2, increments=increments, time_input=False)
        weights = initialise(architecture, seeds)
        weights = {n: torch.zeros_like(w) if "output" in n else w for n, w in weights.items()}
        network = Network(architecture, Scaling.of(trials), weights, "carried", history).trainable()
        emg, angle = to_tensors(trials, CPU)
        corpus = Corpus.of(network, emg, angle[None], trials.dt, torch.tensor(trials.lengths))
        random = torch.Generator().manual_seed(1)  # the same windows every time
        return RolloutLoss(network, corpus, steps, Noise(noise, seeds, 0), random).backward().data

    return roll


def test_noise_on_the_history_of_a_rollout_moves_its_last_angle_and_its_last_step(rolled):
    """Without output an increment network goes straight on: errors n, n' of the last two angles become n + k (n - n')
    after k steps, with variance s^2 ((1 + k)^2 + k^2)."""
    noise = 0.2
    expected = noise**2 * sum((1 + k) ** 2 + k**2 for k in (1, 2, 3, 4)) / 4
    gained = rolled(noise, increments=True) - rolled(0.0, increments=True)
    assert gained.mean().item() == pytest.approx(expected, rel=0.1)
    assert gained.std() > 0, "each seed has noise of its own"


def test_noise_on_the_history_is_not_on_the_target_of_a_rollout(rolled):
    """Without output an absolute network predicts the mean angle whatever its history was."""
    torch.testing.assert_close(rolled(0.2, increments=False), rolled(0.0, increments=False))


def test_noise_has_its_size_and_differs_between_seeds_scales_and_epochs():
    like = torch.zeros((), dtype=torch.float64)
    noise = Noise(0.1, (3, 5), 1)
    first, second = (noise.draw(4000, like=like) for _ in range(2))
    single, coarser = (Noise(0.1, (5,), level).draw(4000, like=like) for level in (1, 2))
    assert first.std(1).tolist() == pytest.approx([0.1, 0.1], rel=0.05)
    torch.testing.assert_close(single[0], first[1], rtol=0, atol=0)
    rows = torch.stack([first[0], first[1], second[0], second[1], coarser[0]])
    assert (torch.corrcoef(rows) - torch.eye(5)).abs().max() < 0.1
