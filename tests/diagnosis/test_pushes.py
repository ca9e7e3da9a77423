"""What more excitation adds to the state is what a simulation with more of it shows."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.diagnosis.likelihood.components import EMG, GAINS, residual_of
from myowave.diagnosis.likelihood.forcing import (
    MORE_EXCITATION,
    answers,
    by_samples,
    forcing_by,
    moved_by,
    through_sensor,
)
from myowave.diagnosis.likelihood.waves import View
from myowave.identification.free_parameters import Free
from myowave.identification.output_error import Fit, Problem
from myowave.physics.motion import observe, simulate


def test_the_forcing_is_what_more_excitation_adds_to_the_state(make_fit):
    """One more in all excitations at once, by the trial's own simulation with EMG that is 1e-4 higher."""
    made = make_fit()
    forcing = forcing_by(made, MORE_EXCITATION)
    assert forcing.shape == (*made.linear.after.shape, 2)
    flexor, extensor = np.moveaxis(forcing[..., 1, :], -1, 0)
    assert (flexor > -1e-9).all() and (extensor < 1e-9).all()
    simulation, step = made.simulation, 1e-4
    more = replace(simulation, emg=simulation.emg + step)
    start = torch.from_numpy(made.starts)
    angles = [simulate(s, start[:, 0], start[:, 1]).q.numpy() for s in (simulation, more)]
    state = np.zeros((len(made.record.names), 2))
    moved = [state[:, 0]]
    for n in range(forcing.shape[1]):
        state = (made.linear.jacobian.numpy()[:, n] @ state[..., None])[..., 0] + forcing[:, n].sum(-1)
        moved.append(state[:, 0])
    np.testing.assert_allclose(np.stack(moved, -1), (angles[1] - angles[0]) / step, rtol=0.03, atol=0.03)


def seen_by(fit: Fit, model, more: tuple[Free, ...] = (), values=(), **changed) -> Fit:
    """Another model, with further values, where a fit stands."""
    values = np.r_[fit.values, np.array(values)]
    problem = Problem.of(model, replace(fit.record, **changed), (*fit.free, *more), values)
    return problem.fit_at(values, fit.starts, fit.sensitive.motion.state)


def angles_with(fit: Fit, emg: torch.Tensor) -> np.ndarray:
    start = torch.from_numpy(fit.starts)
    return simulate(replace(fit.simulation, emg=emg), start[:, 0], start[:, 1]).angle.numpy()


def of_one_electrode(fit: Fit) -> Fit:
    """The same with both muscles on the first electrode."""
    first, second = fit.model.muscles
    model = replace(fit.model, muscles=(first, replace(second, channel=first.channel)))
    return seen_by(fit, model, emg=fit.record.emg[..., [0, 0]])


@pytest.mark.parametrize("sample", [0, 1, 57])
@pytest.mark.parametrize("shared", [False, True])
def test_what_a_sample_of_an_electrode_does_is_what_a_simulation_shows(make_fit, sample, shared):
    """Also the first one, which lasts as long as muscles are late, and an electrode of two muscles."""
    fit = of_one_electrode(make_fit()) if shared else make_fit()
    waves, step = View.of(fit).band.waves, 1e-4
    found = answers(fit.linear.jacobian.numpy(), forcing_by(fit, MORE_EXCITATION), through_sensor(fit, waves))
    said = by_samples(fit, torch.from_numpy(found))[sample, :, 0]
    more = fit.record.emg.clone()
    more[:, sample, slice(None) if shared else 0] += step
    moved = (angles_with(fit, more) - angles_with(fit, fit.record.emg)) / step
    slow = slice(1, 12)
    seen = np.einsum("tnw,tn->tw", waves.numpy(), moved)[:, slow]
    np.testing.assert_allclose(said[:, slow].numpy(), seen, atol=0.04 * np.abs(seen).max())
    block = residual_of(fit, View.of(fit)).component(EMG).blocks
    assert block is not None and float((said**2).sum()) < float(block.diagonal(dim1=-2, dim2=-1).sum())


def test_a_gain_is_that_of_an_electrode_whatever_it_drives(make_fit):
    fit, step = of_one_electrode(make_fit()), 1e-4
    emg, view, slow = fit.record.emg, View.of(fit), slice(1, 12)
    moved = (angles_with(fit, (1 + step) * emg) - angles_with(fit, emg)) / step
    seen = np.einsum("tnw,tn->tw", view.band.waves.numpy(), moved)[:, slow]
    block = residual_of(fit, view).component(GAINS).blocks
    assert block is not None
    said = block[:, slow, slow].numpy()
    np.testing.assert_allclose(said, seen[:, :, None] * seen[:, None], atol=0.1 * np.abs(said).max())


@pytest.mark.parametrize(
    ("name", "value"), [("observation_lag", 0.1), ("clock_shift", -0.05), ("clock_drift", 0.01), ("angle_scale", 0.2)]
)
def test_a_push_is_seen_through_the_sensor_of_the_model(make_fit, effects, name, value):
    fit, effect = make_fit(), effects[name]
    ((short, p),) = effect.parameters.items()
    free = Free(f"{name}.{short}", 0.0, p.low, p.high, p.typical)
    fit = seen_by(fit, fit.model.with_effects([effect]), (free,), (value,))
    forcing, waves, at, step = forcing_by(fit, MORE_EXCITATION), View.of(fit).band.waves, 50, 1e-4
    push = forcing * (np.arange(forcing.shape[1]) == at)[:, None, None]
    said = moved_by(fit, push)[..., 0]
    state = fit.sensitive.motion.state
    joint = seen_by(make_fit(), make_fit().model)  # the same motion without that sensor
    unseen = moved_by(joint, push)[..., 0]
    assert not np.allclose(said, unseen, atol=0.05 * np.abs(unseen).max())
    amplitude = answers(fit.linear.jacobian.numpy(), push, through_sensor(fit, waves))[at][:, 0]
    np.testing.assert_allclose(np.einsum("tnw,tn->tw", waves.numpy(), said), amplitude, rtol=1e-6, atol=1e-9)
    pushed, jacobian, after = torch.from_numpy(step * push[..., 0]), fit.linear.jacobian, [state[:, 0]]
    for n in range(pushed.shape[1]):
        carried = (jacobian[:, n] @ (after[-1] - state[:, n])[..., None])[..., 0]
        after.append(state[:, n + 1] + carried + pushed[:, n])
    both = torch.stack([torch.stack(after, 1), state])
    moved, still = observe(fit.simulation, *both[..., :2].unbind(-1))
    np.testing.assert_allclose(said, ((moved - still) / step).numpy(), rtol=1e-3, atol=1e-6)
