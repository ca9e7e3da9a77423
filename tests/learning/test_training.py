"""Training: seeds do not touch each other, scales hand on, and what does not fit is refused."""

from collections.abc import Sequence
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
import torch

from myowave.data.wavelets import decompose
from myowave.learning.checkpoint import Checkpoint, digest_model
from myowave.learning.evaluation import tabulate_parameters
from myowave.learning.inputs import to_tensors
from myowave.learning.methods import rollout as rollouts
from myowave.learning.methods.rollout.augmentation import imagine_emg
from myowave.learning.methods.rollout.training import CLIP, clip_gradients, weigh_physics
from myowave.learning.task import Task, begin_stage
from myowave.learning.training import VALIDATE_EVERY, EpochReport, train_scale
from myowave.learning.windows import Corpus, Validation, count_training_samples
from myowave.physics.path import TablePath


def train(task: Task) -> tuple[Sequence[EpochReport], Checkpoint]:
    """Train all scales; the reports of all, and the last checkpoint."""
    checkpoint, reports = None, []
    for level in reversed(range(task.total)):
        reports += train_scale(task, level, checkpoint)
        checkpoint = reports[-1].checkpoint
    return reports, checkpoint


def changed(task: Task, **settings) -> Task:
    """The task with other settings of its recipe."""
    return replace(task, recipe=task.recipe.model_copy(update=settings))


@pytest.mark.parametrize("kind", ["rollout", "teacher_forced"])
def test_a_seed_trains_the_same_alone_and_among_others(kind, request):
    task = request.getfixturevalue(kind)
    among, together = train(replace(task, seeds=(3, 5)))
    single, alone = train(replace(task, seeds=(5,)))
    for many, one in zip(among, single, strict=True):
        torch.testing.assert_close(many.losses.total[1:], one.losses.total, rtol=1e-3, atol=0)
    for name, value in alone.weights.items():
        torch.testing.assert_close(together.weights[name][1], value[0], rtol=1e-4, atol=1e-5, msg=name)
    torch.testing.assert_close(together.values[1], alone.values[0], rtol=1e-6, atol=0)


def test_simulated_motion_counts_the_less_the_worse_physics_is_and_not_at_all_where_it_is_far_worse():
    physics, network = torch.tensor([1e-6, 1e-4, 1.25e-4, 2.1e-4, 1e-2]), torch.full((5,), 1e-4)
    assert weigh_physics(physics, network).tolist() == pytest.approx([1.0, 1.0, 0.8, 0.0, 0.0])


def test_a_seed_whose_physics_counts_nothing_trains_the_same_beside_one_whose_physics_counts(rollout, monkeypatch):
    def trained(seeds):
        trust = torch.tensor([float(seed == 3) for seed in seeds])
        monkeypatch.setattr(rollouts.training, "weigh_physics", lambda physics, network: trust)
        return train(changed(replace(rollout, seeds=seeds), epochs=30))[0]

    for many, one in zip(trained((3, 5)), trained((5,)), strict=True):
        torch.testing.assert_close(many.losses.total[1:], one.losses.total, rtol=1e-3, atol=0)


@pytest.fixture
def hopeless(rollout):
    """A forearm so light that no motion of the model follows the trials."""
    light = {level: replace(trials, constants={"mass": 1e-3}) for level, trials in rollout.scales.items()}
    return changed(replace(rollout, scales=light), epochs=20)


def test_physics_that_does_not_follow_the_trials_teaches_nothing_and_stops_nothing(hopeless):
    reports, last = train(hopeless)
    without, _ = train(changed(hopeless, simulated_trials=0))
    assert not (last.physics_mse < last.scaling.angle_std**2).any()
    assert last.val_r2.isfinite().all() and last.values.isfinite().all()
    for one, other in zip(reports, without, strict=True):
        assert torch.equal(one.losses.total, other.losses.total) and torch.equal(one.val_mse, other.val_mse)


def test_values_of_physics_that_does_not_follow_the_trials_carry_a_note(hopeless, rollout):
    notes = tabulate_parameters(train(hopeless)[1])["note"]
    assert notes.str.startswith("not to be trusted: motion simulated with these values ").all()
    assert not tabulate_parameters(train(changed(rollout, epochs=20))[1])["note"].str.startswith("not").any()


def test_only_a_gradient_that_is_too_large_is_shortened():
    weights = {name: torch.zeros(2, 3, 4, requires_grad=True) for name in "ab"}
    for value in weights.values():
        value.grad = torch.ones_like(value) * torch.tensor([1e-3, 1e3])[:, None, None]
    clip_gradients(weights.values())
    small, large = torch.stack([value.grad for value in weights.values()], dim=1)
    torch.testing.assert_close(small, torch.full_like(small, 1e-3))
    torch.testing.assert_close(large.norm(), torch.tensor(CLIP))
    torch.testing.assert_close(large, large[:1, :1, :1].expand_as(large))  # the direction stays


def test_each_seed_keeps_the_weights_of_its_own_lowest_validation_error(rollout):
    task = changed(replace(rollout, seeds=(0, 1, 2)), epochs=60, learning_rate=0.3, simulated_trials=0)
    reports, last = train(task)
    errors = torch.stack([report.val_mse for report in reports])
    assert len(set(errors.argmin(0).tolist())) > 1, "no seed went on beyond the best epoch of another"
    network, trials = last.network, task.training_trials(0)
    usable = torch.tensor(count_training_samples(trials, task.recipe.validation_fraction, network.history))
    emg, angle = to_tensors(trials, torch.device("cpu"))
    held_out = Validation(Corpus.of(network, emg, angle[None], trials.dt, usable), network, trials.lengths)
    torch.testing.assert_close(held_out.mse(), errors.min(0).values, rtol=1e-4, atol=0)


def test_the_same_seed_gives_the_same_result_twice(rollout):
    _, first = train(rollout)
    _, second = train(rollout)
    assert all(torch.equal(first.weights[name], second.weights[name]) for name in first.weights)
    assert torch.equal(first.values, second.values)


@pytest.mark.parametrize(("kind", "total", "epochs"), [("rollout", 1, 18), ("teacher_forced", 2, 6)])
def test_the_test_trial_changes_nothing(kind, total, epochs, trials, request, monkeypatch):
    """Neither scaling nor training, early stopping, identification, or the EMG that is made up after its 14 steps."""
    made_up = Mock(side_effect=imagine_emg)
    monkeypatch.setattr(rollouts.training, "imagine_emg", made_up)
    task = changed(request.getfixturevalue(kind), epochs=epochs, simulated_trials=2 * (total == 1))
    random, hidden = np.random.default_rng(0), replace(trials, angle=trials.angle.copy(), emg=trials.emg.copy())
    (test,) = trials.index(trials.test)
    hidden.angle[test] = 1.0 + 0.3 * random.standard_normal(hidden.angle[test].shape)
    hidden.emg[test] = random.random(hidden.emg[test].shape)
    (reports, seen), (others, unseen) = (
        train(replace(task, scales=decompose(each, 1), total=total, seeds=(0,))) for each in (trials, hidden)
    )
    assert made_up.call_count == (2 if kind == "rollout" else 0)
    assert seen.scaling == unseen.scaling
    for name in seen.weights:
        assert torch.equal(seen.weights[name], unseen.weights[name]), name
    for field in ("values", "errors", "val_r2"):
        assert torch.equal(getattr(seen, field).nan_to_num(), getattr(unseen, field).nan_to_num()), field
    for one, other in zip(reports, others, strict=True):
        assert torch.equal(one.losses.total, other.losses.total) and torch.equal(one.val_mse, other.val_mse)


@pytest.mark.parametrize("total", [1, 2, 3])
def test_every_number_of_scales_has_the_same_epochs(total, rollout):
    task = replace(rollout, total=total)
    assert sum(task.epochs(level) for level in range(total)) == rollout.recipe.epochs


def test_a_scale_starts_from_the_checkpoint_of_the_coarser_one(rollout, tmp_path):
    task = replace(rollout, total=2)
    _, at_once = train(task)
    assert at_once.level == 0 and at_once.epochs == task.recipe.epochs
    *_, last = train_scale(task, level=1)
    last.checkpoint.save(tmp_path / "scale-1.pt")
    *_, finest = train_scale(task, level=0, before=Checkpoint.load(tmp_path / "scale-1.pt"))
    for name, value in at_once.weights.items():
        assert torch.equal(finest.checkpoint.weights[name], value), name


def test_training_lowers_the_error_of_free_running(rollout):
    reports, _ = train(changed(rollout, epochs=80, learning_rate=0.02))
    assert (reports[-1].val_mse < 0.5 * reports[0].val_mse).all()


@pytest.mark.parametrize("optimiser", ["adam", "soap"])
def test_either_optimiser_lowers_the_loss_of_rollouts(optimiser, rollout):
    task = changed(rollout, epochs=60, learning_rate=0.01, simulated_trials=0, optimiser=optimiser)
    reports, _ = train(task)
    first, last = (sum(r.losses.data.mean().item() for r in part) for part in (reports[:3], reports[-3:]))
    assert last < 0.7 * first


@pytest.mark.parametrize("kind", ["rollout", "teacher_forced"])
def test_networks_learn_where_nothing_is_to_identify(kind, request):
    task = replace(request.getfixturevalue(kind), wanted={})
    _, last = train(changed(task, epochs=20))
    assert last.values.shape == (2, 0) and last.val_r2.isfinite().all()


def test_teacher_forced_training_lowers_the_loss(teacher_forced):
    reports, _ = train(changed(teacher_forced, epochs=40, learning_rate=0.01))
    assert (reports[-1].losses.total < 0.5 * reports[0].losses.total).all()
    assert (reports[-1].values["f0_Bi"] != reports[0].values["f0_Bi"]).all()


def test_rows_have_a_column_for_every_identified_parameter(rollout, wanted):
    reports, _ = train(rollout)
    rows = reports[-1].rows()
    assert [row["seed"] for row in rows] == [0, 1]
    assert set(rows[0]) == {"epoch", "seed", "loss", "data_loss", "residual_loss", "val_mse", *wanted}


def test_a_checkpoint_of_another_recipe_is_refused_with_the_reason(rollout):
    task = replace(rollout, total=2)
    *_, last = train_scale(task, level=1)
    with pytest.raises(ValueError, match="recipe.learning_rate was 0.003 .* is 0.5 now"):
        next(train_scale(changed(task, learning_rate=0.5), level=0, before=last.checkpoint))


def test_a_checkpoint_of_other_data_is_refused(rollout):
    task = replace(rollout, total=2)
    *_, last = train_scale(task, level=1)
    other = {level: replace(trials, angle=trials.angle * 1.01) for level, trials in task.scales.items()}
    with pytest.raises(ValueError, match="dataset_digest"):
        next(train_scale(replace(task, scales=other), level=0, before=last.checkpoint))


def test_a_checkpoint_of_another_arm_is_refused(rollout, effects):
    """Though its constants have the same values."""
    task, (biceps, triceps) = replace(rollout, total=2), rollout.model.muscles
    angle = np.linspace(-0.5, 3.0, 20)
    tables = [TablePath.through(angle, 0.5 - size * np.sin(angle / 2)) for size in (0.03, 0.04)]
    one, other = (replace(biceps, path=table) for table in tables)
    damped = effects["joint_damping"]
    models = [
        *(replace(task.model, muscles=(muscle, triceps)) for muscle in (one, other)),
        replace(task.model, muscles=(replace(one, channel=triceps.channel), triceps)),
        replace(task.model, muscles=(replace(one, side=-one.side), triceps)),
        *(task.model.with_effects([replace(damped, equation=as_if)]) for as_if in ("-c qdot", "-c qdot^3")),
    ]
    assert len({digest_model(model) for model in models}) == len(models)
    task = replace(task, model=models[0])
    *_, last = train_scale(task, level=1)
    with pytest.raises(ValueError, match="model_digest"):
        next(train_scale(replace(task, model=models[1]), level=0, before=last.checkpoint))


def test_a_finer_scale_without_a_checkpoint_is_refused(rollout):
    with pytest.raises(AssertionError, match="starts from the checkpoint"):
        next(train_scale(replace(rollout, total=2), level=0))


def test_too_short_trials_are_refused(rollout):
    with pytest.raises(ValueError, match="too few"):
        next(train_scale(changed(rollout, history_steps=190), level=0))


def test_a_file_that_is_no_checkpoint_is_refused(tmp_path):
    path = tmp_path / "scale-0.pt"
    path.write_text("not a checkpoint")
    with pytest.raises(ValueError, match="not a checkpoint"):
        Checkpoint.load(path)


def test_early_stopping_keeps_the_best_weights_and_the_last_parameters(teacher_forced):
    reports, checkpoint = train(changed(teacher_forced, epochs=40, learning_rate=0.3))
    validation = torch.stack([report.val_mse for report in reports[VALIDATE_EVERY - 1 :]])
    assert (validation.argmin(0) < len(validation) - 1).any(), "no seed was best before the last epoch"
    stage = begin_stage(teacher_forced, level=0)
    variance = Validation(stage.corpus, stage.network, stage.trials.lengths).variance
    torch.testing.assert_close(checkpoint.val_r2, 1 - validation.min(0).values / variance)
    last = torch.stack([reports[-1].values[name] for name in checkpoint.names], dim=-1)
    torch.testing.assert_close(checkpoint.values, last)


def test_training_stops_once_no_seed_has_improved_for_its_patience(teacher_forced):
    reports, checkpoint = train(changed(teacher_forced, epochs=300, learning_rate=0.3, patience=15))
    assert checkpoint.epochs == len(reports) < 300
    validation = torch.stack([report.val_mse for report in reports[VALIDATE_EVERY - 1 :: VALIDATE_EVERY]])
    best = VALIDATE_EVERY * (validation.argmin(0) + 1)
    assert len(reports) - best.max() == 15
