"""Windows: from anywhere in the part that trains, and validation from all that comes after it."""

import pytest
import torch

from myowave.learning.inputs import to_tensors
from myowave.learning.network import Architecture, Network, Scaling, initialise
from myowave.learning.windows import Corpus, Pieces, Validation

CPU = torch.device("cpu")
USABLE, LENGTHS = torch.tensor([150, 180, 60]), (170, 200, 75)


@pytest.fixture
def network(trials):
    architecture = Architecture("rollout", 6, 2, history=4)
    return Network(architecture, Scaling.of(trials), initialise(architecture, (0,)))


@pytest.fixture
def corpus(network, trials):
    emg, angle = to_tensors(trials, CPU)
    return Corpus.of(network, emg, angle[None], trials.dt, USABLE)


def test_training_windows_end_before_what_validates_and_reach_everything_else(corpus):
    length = 20
    drawn = Pieces.draw(corpus.usable, 20000, length, torch.Generator().manual_seed(0))
    for i, usable in enumerate(USABLE.tolist()):
        begun = drawn.start[drawn.trial == i]
        assert begun.min() == 0 and begun.max() + length == usable
        share = (usable - length + 1) / (USABLE - length + 1).sum().item()
        assert len(begun) / 20000 == pytest.approx(share, rel=0.1)


def test_a_window_holds_the_samples_it_says(corpus, trials):
    trial, start = torch.tensor([2, 0]), torch.tensor([7, 100])
    _, z, _ = corpus.cut(Pieces(trial, start, 5))
    scaling = Scaling.of(trials)
    for row, (t, n) in enumerate(zip(trial.tolist(), start.tolist(), strict=True)):
        expected = (torch.from_numpy(trials.angle[t, n : n + 5]) - scaling.angle_mean) / scaling.angle_std
        torch.testing.assert_close(z[0, row], expected.float())


def test_validation_predicts_all_that_does_not_train_and_nothing_else(corpus, network, trials):
    held_out = Validation(corpus, network, LENGTHS)
    for i, (usable, length) in enumerate(zip(USABLE.tolist(), LENGTHS, strict=True)):
        predicted = held_out.angle[i][held_out.valid[i]]
        torch.testing.assert_close(predicted, torch.from_numpy(trials.angle[i, usable:length]), rtol=0, atol=1e-6)
    assert held_out.score(held_out.angle[None] + 0.1).item() == pytest.approx(0.01)
    assert held_out.variance == pytest.approx(held_out.angle[held_out.valid].var(correction=0).item())
