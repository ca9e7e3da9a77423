"""Noise on the history: of its size, each seed's own, on the angles that are given and never on those to predict."""

from dataclasses import replace

import pytest
import torch

from myowave.learning.loss import Noise
from myowave.learning.network import Architecture, Network, Scaling, initialise
from myowave.learning.paper.loss import PaperLoss
from myowave.learning.paper.windowed import first_predicted, predict_teacher_forced
from myowave.learning.prediction import to_tensors
from myowave.learning.rollouts.loss import RolloutLoss
from myowave.learning.task import begin_stage
from myowave.learning.windows import Corpus

CPU = torch.device("cpu")


@pytest.fixture
def rolled(trials):
    """The rollout loss (S,) of networks whose output weights are 0."""
    seeds, steps, history = range(20), 4, 3
    emg, angle = to_tensors(trials, CPU)

    def make(std, increments):
        architecture = Architecture("gru", 6, 2, increments=increments, time_input=False)
        weights = {n: torch.zeros_like(w) if "output" in n else w for n, w in initialise(architecture, seeds).items()}
        network = Network(architecture, Scaling.of(trials), weights, "carried", history).trainable()
        corpus = Corpus.of(network, emg, angle[None], trials.dt, torch.tensor(trials.lengths))
        same_windows = torch.Generator().manual_seed(1)
        return RolloutLoss(network, corpus, steps, Noise(std, seeds, 0), same_windows).backward().data

    return make


def test_noise_on_the_history_of_a_rollout_moves_its_last_angle_and_its_last_step(rolled):
    """Without output an increment network goes straight on: errors n, n' of the last two angles become n + k (n - n')
    after k steps, with variance s^2 ((1 + k)^2 + k^2)."""
    std = 0.2
    expected = std**2 * sum((1 + k) ** 2 + k**2 for k in (1, 2, 3, 4)) / 4
    gained = rolled(std, increments=True) - rolled(0.0, increments=True)
    assert gained.mean().item() == pytest.approx(expected, rel=0.1)
    assert gained.std() > 0, "each seed has noise of its own"


def test_noise_on_the_history_is_not_on_the_target_of_a_rollout(rolled):
    """Without output an absolute network predicts the mean angle whatever its history was."""
    torch.testing.assert_close(rolled(0.2, increments=False), rolled(0.0, increments=False))


def test_noise_on_the_history_of_one_step_is_not_on_the_target(teacher_forced):
    """J_data of predictions from noisy angles against measured ones, by hand."""
    std = 0.3
    recipe = teacher_forced.recipe.model_copy(update={"history_noise": std})
    stage = begin_stage(replace(teacher_forced, recipe=recipe), level=0)
    network, (_, angle) = stage.network, to_tensors(stage.trials, CPU)
    noisy = angle + Noise(std, stage.task.seeds, 0).draw(*angle.shape, like=angle)
    usable = int(stage.corpus.usable[0])
    assert (stage.corpus.usable == usable).all()
    expected, without = (
        (predict_teacher_forced(network, stage.corpus.x, seen) - angle)[..., first_predicted(network) : usable]
        .square()
        .mean((1, 2))
        .detach()
        for seen in (noisy, angle)
    )
    params = {name: stage.values[:, i, None] for i, name in enumerate(stage.names)}
    found = PaperLoss(stage).backward(params)
    torch.testing.assert_close(found.data, expected)
    assert (found.data / without - 1).abs().min() > 1e-3


def test_noise_has_its_size_and_differs_between_seeds_scales_and_epochs():
    like = torch.zeros((), dtype=torch.float64)
    noise = Noise(0.1, (3, 5), 1)
    first, second = (noise.draw(4000, like=like) for _ in range(2))
    single, coarser = (Noise(0.1, (5,), level).draw(4000, like=like) for level in (1, 2))
    assert first.std(1).tolist() == pytest.approx([0.1, 0.1], rel=0.05)
    torch.testing.assert_close(single[0], first[1], rtol=0, atol=0)
    rows = torch.stack([first[0], first[1], second[0], second[1], coarser[0]])
    assert (torch.corrcoef(rows) - torch.eye(5)).abs().max() < 0.1
