"""What a network is told beside EMG: known conditions that differ between trials, and angles over time."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import torch
from typer.testing import CliRunner

from myowave.cli import app
from myowave.data.simulate import simulate_trials
from myowave.data.wavelets import decompose
from myowave.learning.checkpoint import Checkpoint, digest_trials
from myowave.learning.evaluation import predict_trials
from myowave.learning.inputs import Given, given_inputs, known_inputs, known_of
from myowave.learning.methods.rollout.augmentation import imagine_emg, simulate_imagined
from myowave.learning.network import Scaling
from myowave.learning.task import Task, fresh_network
from myowave.learning.training import train_scale
from myowave.physics.effects import catalogue
from myowave.settings import Inputs, RolloutRecipe, SimulatedDataset

DEFAULTS = {"load": 0.0, "tilt": 0.0, "mass": 1.0}
CPU = torch.device("cpu")


@pytest.fixture(scope="module")
def loaded(model):
    """Three trials, the first with 0.5 kg in the hand, and the lean of the upper arm over time; the last tests."""
    dataset = SimulatedDataset(
        kind="simulated", trials=3, samples=200, test=("3",), conditions={"1": {"load": 0.5}, "3": {"load": 0.2}}
    )
    trials = simulate_trials("loaded", dataset, model, catalogue(()))[0]
    lean = 0.1 * np.sin(trials.time)[None] * np.array([[1.0], [2.0], [3.0]])
    tilts = {name: {"tilt": float(np.median(lean[i]))} for i, name in enumerate(trials.names)}
    conditions = {name: {**trials.conditions.get(name, {}), **tilts[name]} for name in trials.names}
    return replace(trials, conditions=conditions, signals={"tilt_rad": lean}, over_time={"tilt": "tilt_rad"})


@pytest.fixture(scope="module")
def told(loaded, model, wanted):
    """A checkpoint of a network that is told load and lean."""
    recipe = RolloutRecipe(hidden=8, epochs=6, rollout_s=0.3, simulated_trials=4, patience=100)
    *_, last = train_scale(Task(decompose(loaded, 0), model, recipe, wanted, total=1, seeds=(0, 1), device=CPU), 0)
    return last.checkpoint


def test_what_differs_between_training_trials_is_an_input_and_a_recorded_angle_stands_for_its_constant(loaded):
    train = loaded.select(loaded.train)
    assert known_inputs(train, DEFAULTS) == {"load": 0.0, "tilt_rad": 0.0}
    alike = replace(train, conditions=dict.fromkeys(train.names, {"load": 0.5}), signals={}, over_time={})
    assert known_inputs(alike, DEFAULTS) == {}


def test_a_measured_torque_is_no_input(loaded):
    told = replace(loaded, signals={**loaded.signals, "torque_Nm": np.full_like(loaded.angle, np.nan)})
    assert known_inputs(told, DEFAULTS) == known_inputs(loaded, DEFAULTS)


def test_a_condition_that_only_the_test_trial_has_is_no_input(loaded, rollout):
    only = replace(loaded, conditions={"3": {"mass": 1.4}}, signals={}, over_time={})
    assert fresh_network(replace(rollout, scales={0: only})).architecture.known == {}


def test_inputs_are_emg_then_what_is_known_at_each_sample(loaded):
    inputs = given_inputs(loaded, {"load": 0.0, "tilt_rad": 0.0})
    np.testing.assert_array_equal(inputs[..., :2], loaded.emg)
    np.testing.assert_array_equal(inputs[..., 2], np.broadcast_to([[0.5], [0.0], [0.2]], loaded.angle.shape))
    np.testing.assert_array_equal(inputs[..., 3], loaded.signals["tilt_rad"])


def test_a_signal_that_trials_lack_is_refused_and_never_0(loaded):
    """A constant that is not known has a value in the model; an angle over time has none."""
    bare = replace(loaded, conditions={}, signals={}, over_time={})
    assert (given_inputs(bare, {"load": 0.7})[..., 2] == 0.7).all()
    with pytest.raises(ValueError, match=r"dataset 'loaded': no tilt_rad, .* are none"):
        given_inputs(bare, {"load": 0.0, "tilt_rad": 0.0})


def test_an_angle_that_hardly_changes_is_not_blown_up(loaded):
    train = loaded.select(loaded.train)
    scaling = Scaling.of(train, Given({"load": 0.0, "tilt_rad": 0.0}, ("load", "tilt_rad")))
    assert scaling.input_std[2] == pytest.approx(0.25), "the load in units of its own spread"
    assert scaling.input_std[3] == scaling.angle_std, "an angle in those of the elbow's"


def test_simulated_trials_are_told_the_constants_they_are_simulated_with(loaded, model):
    train = loaded.select(loaded.train)
    emg = imagine_emg(train, 6, 0)
    _, _, donors = simulate_imagined(model, {}, train, emg, 0)
    assert set(donors) == {0, 1}
    inputs = known_of(train, donors, {"load": 0.0, "tilt_rad": 0.0}, emg.shape[1])
    np.testing.assert_array_equal(inputs[..., 0], np.where(donors == 0, 0.5, 0.0)[:, None].repeat(200, 1))
    tilts = np.array([train.conditions[name]["tilt"] for name in train.names])
    np.testing.assert_array_equal(inputs[..., 1], tilts[donors][:, None].repeat(200, 1))


def test_a_checkpoint_knows_its_inputs_and_other_conditions_move_the_arm_otherwise(told, loaded, tmp_path):
    told.save(tmp_path / "scale-0.pt")
    again = Checkpoint.load(tmp_path / "scale-0.pt")
    assert again.architecture.known == {"load": 0.0, "tilt_rad": 0.0}
    measured = predict_trials(again, loaded)
    heavier = replace(loaded, conditions={**loaded.conditions, "3": {"load": 0.5}})
    again = replace(again, dataset_digest=digest_trials(heavier))
    assert (predict_trials(again, heavier) - measured)[:, 2].abs().max() > 1e-4


@pytest.mark.parametrize("change", [{"signals": {"tilt_rad": np.full((3, 200), 0.3)}}, {"real_time": {"gain": 2.0}}])
def test_trials_that_differ_in_a_recorded_angle_or_in_what_raw_emg_becomes_alone_are_other_trials(loaded, change):
    assert digest_trials(replace(loaded, **change)) != digest_trials(loaded)


def test_without_conditions_networks_train_as_if_inputs_had_never_been_there(rollout):
    def weights(task):
        *_, last = train_scale(task, level=0)
        return last.checkpoint.weights

    free = weights(rollout)
    none = weights(replace(rollout, recipe=rollout.recipe.model_copy(update={"known_inputs": ()})))
    for name, value in free.items():
        assert torch.equal(value, none[name])


@pytest.fixture(scope="module")
def checkpoint_file(told, tmp_path_factory):
    path = tmp_path_factory.mktemp("told") / "scale-0.pt"
    told.save(path)
    return path


@pytest.fixture
def table(loaded) -> pd.DataFrame:
    emg = dict(zip(loaded.channels, loaded.emg[2].T, strict=True))
    return pd.DataFrame({"time_s": loaded.time, "load": 0.2, "tilt_rad": loaded.signals["tilt_rad"][2], **emg})


def predict(path, table, *options: str):
    arguments = ["predict", "--checkpoint", str(path), "--emg", "-", "--start-deg", "30", *options]
    return CliRunner().invoke(app, arguments, input=table.to_csv(index=False))


def test_what_is_known_comes_as_columns_or_once_for_the_run(told, checkpoint_file, loaded, table):
    columns = predict(checkpoint_file, table)
    assert columns.exit_code == 0, columns.output
    option = predict(checkpoint_file, table.drop(columns="load"), "--known", "load=0.2")
    assert option.stdout == columns.stdout
    given = replace(loaded, angle=np.full_like(loaded.angle, np.pi / 6))
    batch = predict_trials(replace(told, dataset_digest=digest_trials(given)), given)[:, 2].mean(0)
    written = [float(line.split(",")[1]) for line in columns.stdout.splitlines()[1:]]
    np.testing.assert_allclose(written, batch, rtol=0, atol=1e-6)


REFUSED = {
    "no column": (["load"], [], "no column load", "--known load=VALUE"),
    "another name": ([], ["weight=2"], "takes no 'weight'", "load, tilt_rad"),
    "close to a name": ([], ["lod=2"], "did you mean 'load'?", "load, tilt_rad"),
    "no number": (["load"], ["load=heavy"], "load is nan", "0 to 200 kg"),
    "not a number": (["load"], ["load=nan"], "load is nan", "0 to 200 kg"),
    "beyond all bounds": (["load"], ["load=-1"], "load is -1", "0 to 200 kg"),
    "degrees": (["tilt_rad"], ["tilt_rad=20"], "tilt_rad is 20", "rad"),
    "twice": (["load"], ["load=1", "load=2"], "load is given more than once", "keep one"),
}


@pytest.mark.parametrize("fault", REFUSED)
def test_a_known_input_that_cannot_be_is_one_clear_line(checkpoint_file, table, fault):
    missing, options, *says = REFUSED[fault]
    result = predict(checkpoint_file, table.drop(columns=missing), *(x for o in options for x in ("--known", o)))
    assert result.exit_code == 2 and len(result.stderr.splitlines()) == 1, result.output
    assert all(text in result.stderr for text in says), result.stderr


def test_a_column_out_of_bounds_is_named_by_its_line(checkpoint_file, table):
    table.loc[3, "tilt_rad"] = 30.0
    result = predict(checkpoint_file, table)
    assert result.exit_code == 2 and "line 5: tilt_rad is 30" in result.stderr


def test_a_network_without_known_inputs_takes_none(rollout, tmp_path, table):
    *_, last = train_scale(rollout, level=0)
    last.checkpoint.save(tmp_path / "scale-0.pt")
    result = predict(tmp_path / "scale-0.pt", table, "--known", "load=1")
    assert result.exit_code == 2 and "Beside EMG it takes nothing" in result.stderr


@pytest.fixture(scope="module")
def weighed(loaded, model, wanted):
    """A checkpoint of a network whose EMG counts over the torque of weight and load, and which is told nothing."""
    recipe = RolloutRecipe(hidden=8, epochs=6, rollout_s=0.3, simulated_trials=4, emg_over="weight", known_inputs=())
    *_, last = train_scale(Task(decompose(loaded, 0), model, recipe, wanted, total=1, seeds=(0, 1), device=CPU), 0)
    return last.checkpoint


def test_emg_over_weight_means_the_same_with_every_load(weighed, loaded):
    # A point mass of 1 kg at 1 m: 0.2 kg in the hand want 1.2 times the torque of none.
    without, by_load = weighed.architecture.given.holding
    assert by_load == pytest.approx(without) and weighed.architecture.inputs == 2
    lighter = replace(loaded, emg=loaded.emg / np.array([1.5, 1.0, 1.2])[:, None, None], conditions={})
    again = replace(weighed, dataset_digest=digest_trials(lighter))
    torch.testing.assert_close(predict_trials(again, lighter), predict_trials(weighed, loaded), rtol=0, atol=1e-5)


def test_a_stream_is_told_the_load_that_emg_counts_over(weighed, loaded, table, tmp_path):
    weighed.save(tmp_path / "scale-0.pt")
    streamed = predict(tmp_path / "scale-0.pt", table)
    assert streamed.exit_code == 0, streamed.output
    given = replace(loaded, angle=np.full_like(loaded.angle, np.pi / 6))
    batch = predict_trials(replace(weighed, dataset_digest=digest_trials(given)), given)[:, 2].mean(0)
    written = [float(line.split(",")[1]) for line in streamed.stdout.splitlines()[1:]]
    np.testing.assert_allclose(written, batch, rtol=0, atol=1e-6)


def test_without_a_known_load_emg_counts_as_it_is(loaded, model):
    unknown = replace(loaded, conditions={}, signals={}, over_time={})
    assert Given.of(unknown, model, Inputs(emg_over="weight")) == Given()
