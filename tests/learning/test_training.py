"""Training: seeds do not touch each other, scales hand on, and what does not fit is refused."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.data.wavelets import decompose
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.prediction import Network, run_free, to_tensors
from myowave.learning.training import CLIP, VALIDATE_EVERY, clip_gradients, count_epochs, train_scale, weigh_physics
from myowave.learning.windows import Corpus, Validation, count_training_samples


def train(scales, model, recipe, wanted, *, seeds=(0, 1), total=1):
    """Train all scales; the reports of all, and the last checkpoint."""
    checkpoint, reports = None, []
    for level in reversed(range(total)):
        reports += train_scale(
            scales, model, recipe, wanted, level=level, total=total, seeds=seeds, start=checkpoint,
            device=torch.device("cpu"),
        )  # fmt: skip
        checkpoint = reports[-1].checkpoint
    return reports, checkpoint


@pytest.mark.parametrize("recipe", ["rollout", "teacher_forced"])
def test_a_seed_trains_the_same_alone_and_among_others(recipe, scales, model, wanted, request):
    recipe = request.getfixturevalue(recipe)
    among, together = train(scales, model, recipe, wanted, seeds=(3, 5))
    single, alone = train(scales, model, recipe, wanted, seeds=(5,))
    for many, one in zip(among, single, strict=True):
        torch.testing.assert_close(many.losses.total[1:], one.losses.total, rtol=1e-3, atol=0)
    for name, value in alone.weights.items():
        torch.testing.assert_close(together.weights[name][1], value[0], rtol=1e-4, atol=1e-5, msg=name)
    torch.testing.assert_close(together.values[1], alone.values[0], rtol=1e-6, atol=0)


def test_simulated_motion_counts_the_less_the_worse_physics_is_beside_the_network():
    physics, network = torch.tensor([1e-6, 1e-4, 1e-2]), torch.full((3,), 1e-4)
    assert weigh_physics(physics, network).tolist() == pytest.approx([1.0, 1.0, 0.01])


def test_a_gradient_too_large_is_shortened_for_its_seed_alone():
    weights = {name: torch.zeros(2, 3, 4, requires_grad=True) for name in "ab"}
    for value in weights.values():
        value.grad = torch.ones_like(value) * torch.tensor([1e-3, 1e3])[:, None, None]
    clip_gradients(weights)
    small, large = torch.stack([value.grad for value in weights.values()], dim=1)
    torch.testing.assert_close(small, torch.full_like(small, 1e-3))
    torch.testing.assert_close(large.norm(), torch.tensor(CLIP))
    torch.testing.assert_close(large, large[:1, :1, :1].expand_as(large))  # the direction stays


def test_each_seed_keeps_the_weights_of_its_own_lowest_validation_error(scales, model, wanted, rollout):
    recipe = rollout.model_copy(update={"epochs": 60, "learning_rate": 0.3, "simulated_trials": 0})
    reports, last = train(scales, model, recipe, wanted, seeds=(0, 1, 2))
    errors = torch.stack([report.val_mse for report in reports])
    assert len(set(errors.argmin(0).tolist())) > 1, "no seed went on beyond the best epoch of another"
    network, trials = Network.of(last), scales[0].select(scales[0].train)
    usable = torch.tensor(count_training_samples(trials, recipe.validation_fraction, network.history))
    emg, angle = to_tensors(trials, torch.device("cpu"))
    corpus = Corpus.of(network.architecture, network.scaling, emg, angle[None], trials.dt, usable)
    held_out = Validation.of(corpus, network.scaling, trials.lengths, network.history)
    z, v = (given.expand(3, -1, -1) for given in (held_out.z, held_out.v))
    again, _ = held_out.score(network.to_rad(run_free(network, held_out.x, z, v)))
    torch.testing.assert_close(again, errors.min(0).values, rtol=1e-4, atol=0)


def test_the_same_seed_gives_the_same_result_twice(scales, model, wanted, rollout):
    _, first = train(scales, model, rollout, wanted)
    _, second = train(scales, model, rollout, wanted)
    assert all(torch.equal(first.weights[name], second.weights[name]) for name in first.weights)
    assert torch.equal(first.values, second.values)


@pytest.mark.parametrize(("protocol", "total", "epochs"), [("rollout", 1, 16), ("teacher_forced", 2, 6)])
def test_the_test_trial_changes_nothing(protocol, total, epochs, trials, model, wanted, request):
    """Neither scaling nor training, early stopping, identification, or the EMG that is made up after its 13 steps."""
    changes = {"epochs": epochs, "simulated_trials": 2 * (total == 1)}
    recipe = request.getfixturevalue(protocol).model_copy(update=changes)
    random, hidden = np.random.default_rng(0), replace(trials, angle=trials.angle.copy(), emg=trials.emg.copy())
    (test,) = trials.index(trials.test)
    hidden.angle[test] = 1.0 + 0.3 * random.standard_normal(hidden.angle[test].shape)
    hidden.emg[test] = random.random(hidden.emg[test].shape)
    reports, seen = train(decompose(trials, 1), model, recipe, wanted, seeds=(0,), total=total)
    others, unseen = train(decompose(hidden, 1), model, recipe, wanted, seeds=(0,), total=total)
    assert seen.scaling == unseen.scaling
    for name in seen.weights:
        assert torch.equal(seen.weights[name], unseen.weights[name]), name
    for field in ("values", "errors", "val_mse", "val_r2"):
        assert torch.equal(getattr(seen, field).nan_to_num(), getattr(unseen, field).nan_to_num()), field
    for one, other in zip(reports, others, strict=True):
        assert torch.equal(one.losses.total, other.losses.total) and torch.equal(one.val_mse, other.val_mse)


@pytest.mark.parametrize("total", [1, 2, 3])
def test_every_number_of_scales_has_the_same_epochs(total, rollout):
    assert sum(count_epochs(rollout, level, total) for level in range(total)) == rollout.epochs


def test_a_scale_starts_from_the_checkpoint_of_the_coarser_one(scales, model, wanted, rollout, tmp_path):
    _, coarse = train({0: scales[0], 1: scales[1]}, model, rollout, wanted, total=2)
    assert coarse.level == 0 and coarse.epochs == rollout.epochs
    reports = train_scale(scales, model, rollout, wanted, level=1, total=2, seeds=(0, 1))
    *_, last = reports
    last.checkpoint.save(tmp_path / "scale-1.pt")
    resumed = Checkpoint.load(tmp_path / "scale-1.pt")
    *_, finest = train_scale(scales, model, rollout, wanted, level=0, total=2, seeds=(0, 1), start=resumed)
    for name, value in coarse.weights.items():
        assert torch.equal(finest.checkpoint.weights[name], value), name


def test_training_lowers_the_error_of_free_running(scales, model, wanted, rollout):
    recipe = rollout.model_copy(update={"epochs": 80, "learning_rate": 0.02})
    reports, _ = train(scales, model, recipe, wanted)
    assert (reports[-1].val_mse < 0.5 * reports[0].val_mse).all()


def test_teacher_forced_training_lowers_the_loss(scales, model, wanted, teacher_forced):
    recipe = teacher_forced.model_copy(update={"epochs": 40, "learning_rate": 0.01})
    reports, _ = train(scales, model, recipe, wanted)
    assert (reports[-1].losses.total < 0.5 * reports[0].losses.total).all()
    assert (reports[-1].values["f0_Bi"] != reports[0].values["f0_Bi"]).all()


def test_rows_have_a_column_for_every_identified_parameter(scales, model, wanted, rollout):
    reports, _ = train(scales, model, rollout, wanted)
    rows = reports[-1].rows()
    assert [row["seed"] for row in rows] == [0, 1]
    assert set(rows[0]) == {"epoch", "seed", "loss", "data_loss", "residual_loss", "val_mse", *wanted}


def test_a_checkpoint_of_another_recipe_is_refused_with_the_reason(scales, model, wanted, rollout):
    *_, last = train_scale(scales, model, rollout, wanted, level=1, total=2, seeds=(0,))
    other = rollout.model_copy(update={"learning_rate": 0.5})
    with pytest.raises(ValueError, match="recipe.learning_rate was 0.003 .* is 0.5 now"):
        next(train_scale(scales, model, other, wanted, level=0, total=2, seeds=(0,), start=last.checkpoint))


def test_a_checkpoint_of_other_data_is_refused(scales, model, wanted, rollout):
    *_, last = train_scale(scales, model, rollout, wanted, level=1, total=2, seeds=(0,))
    changed = {level: replace(trials, angle=trials.angle * 1.01) for level, trials in scales.items()}
    with pytest.raises(ValueError, match="dataset_digest"):
        next(train_scale(changed, model, rollout, wanted, level=0, total=2, seeds=(0,), start=last.checkpoint))


def test_a_finer_scale_without_a_checkpoint_is_refused(scales, model, wanted, rollout):
    with pytest.raises(ValueError, match="starts from the checkpoint"):
        next(train_scale(scales, model, rollout, wanted, level=0, total=2, seeds=(0,)))


def test_too_short_trials_are_refused(scales, model, wanted, rollout):
    recipe = rollout.model_copy(update={"history_steps": 190})
    with pytest.raises(ValueError, match="too few"):
        next(train_scale(scales, model, recipe, wanted, level=0, total=1, seeds=(0,)))


def test_a_file_that_is_no_checkpoint_is_refused(tmp_path):
    path = tmp_path / "scale-0.pt"
    path.write_text("not a checkpoint")
    with pytest.raises(ValueError, match="not a checkpoint"):
        Checkpoint.load(path)


def test_early_stopping_keeps_the_best_weights_and_the_last_parameters(scales, model, wanted, teacher_forced):
    recipe = teacher_forced.model_copy(update={"epochs": 40, "learning_rate": 0.3})
    reports, checkpoint = train(scales, model, recipe, wanted)
    validation = torch.stack([report.val_mse for report in reports[VALIDATE_EVERY - 1 :]])
    assert (validation.argmin(0) < len(validation) - 1).any(), "no seed was best before the last epoch"
    torch.testing.assert_close(checkpoint.val_mse, validation.min(0).values)
    last = torch.stack([reports[-1].values[name] for name in checkpoint.names], dim=-1)
    torch.testing.assert_close(checkpoint.values, last)


def test_training_stops_once_no_seed_has_improved_for_its_patience(scales, model, wanted, teacher_forced):
    recipe = teacher_forced.model_copy(update={"epochs": 300, "learning_rate": 0.3, "patience": 15})
    reports, checkpoint = train(scales, model, recipe, wanted)
    assert checkpoint.epochs == len(reports) < 300
    validation = torch.stack([report.val_mse for report in reports[VALIDATE_EVERY - 1 :: VALIDATE_EVERY]])
    best = VALIDATE_EVERY * (validation.argmin(0) + 1)
    assert len(reports) - best.max() == 15
