"""Windows: from anywhere in the part that trains, and validation from all that comes after it."""

from dataclasses import replace

import pytest
import torch

from myowave.learning.inputs import to_tensors
from myowave.learning.methods.rollout.training import RolloutLoss
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


def test_training_windows_end_before_what_validates_and_share_trials_by_their_length(corpus):
    length = 20
    drawn = Pieces.draw(corpus.usable, 20000, length, torch.Generator().manual_seed(0))
    for i, usable in enumerate(USABLE.tolist()):
        begun = drawn.start[drawn.trial == i]
        assert begun.min() == 0 and begun.max() + length == usable
        assert len(begun) / 20000 == pytest.approx(usable / USABLE.sum().item(), rel=0.1)
        early = (begun < (usable - length + 1) / 3).double().mean().item()
        assert early == pytest.approx(1 / 3, abs=0.03), "all places in a trial are alike"
    assert drawn.within(corpus.usable).all()


def test_a_trial_shorter_than_a_window_trains_with_all_that_it_has(corpus):
    drawn = Pieces.draw(corpus.usable, 2000, 100, torch.Generator().manual_seed(0))
    short = drawn.trial == 2
    assert (drawn.start[short] == 0).all() and short.double().mean().item() == pytest.approx(60 / 390, rel=0.2)
    assert (drawn.within(corpus.usable).sum(1) == torch.where(short, 60, 100)).all()


def test_a_loss_counts_no_sample_that_validates(corpus, network, settings):
    recipe = settings.learning.recipes["rollout"]

    def loss(z):
        changed = replace(corpus, z=z)
        return RolloutLoss(network.trainable(CPU), changed, recipe, 100, (0,)).backward().total

    sample, rest = torch.arange(corpus.z.shape[-1]), corpus.z.clone()
    rest[:, sample >= USABLE[:, None]] += 1.0
    assert loss(corpus.z) == loss(rest)
    rest[:, 2, 59] += 1.0  # the last one that trains, of the trial that is shorter than a window
    assert loss(corpus.z) != loss(rest)


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
