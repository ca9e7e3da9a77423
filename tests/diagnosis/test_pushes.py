"""What more excitation adds to the state is what a simulation with more of it shows."""

from dataclasses import replace

import numpy as np
import torch

from myowave.diagnosis.likelihood.forcing import excitation_forcing
from myowave.physics.motion import simulate


def test_the_forcing_is_what_more_excitation_adds_to_the_state(make_fit):
    """One more in all excitations at once, by the trial's own simulation with EMG that is 1e-4 higher."""
    made = make_fit()
    forcing = excitation_forcing(made)
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
