"""Noise on the history: of its size, each seed's own, on the angles that are given and never on those to predict."""

from dataclasses import replace

import pytest
import torch

from myowave.learning.inputs import to_tensors
from myowave.learning.methods.paper.one_step import predict_teacher_forced
from myowave.learning.methods.paper.training import PaperTraining
from myowave.learning.task import begin_stage
from myowave.learning.windows import Noise

CPU = torch.device("cpu")


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
        (predict_teacher_forced(network, stage.corpus.x, seen) - angle)[..., network.history : usable]
        .square()
        .mean((1, 2))
        .detach()
        for seen in (noisy, angle)
    )
    params = {name: stage.values[:, i, None] for i, name in enumerate(stage.names)}
    found = PaperTraining(stage).backward(params)
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
