"""What a dynamometer measured counts for the parameters that pages show, as for the fit."""

from dataclasses import replace

import pytest
import torch

from myowave.diagnosis.likelihood.hypothesis import Hypothesis
from myowave.diagnosis.likelihood.waves import View
from myowave.diagnosis.search.next_trial import Menu, propose_trials
from myowave.identification.free_parameters import free_parameters
from myowave.identification.output_error import fit_model
from myowave.identification.record import make_record
from myowave.physics.dynamics import torques
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation
from myowave.settings import Identify, Scatter

TRUE = {"f0_Bi": 390.0, "f0_Tri": 390.0, "mass": 1.3}  # all 1.3 times the usual: no motion shows it


@pytest.fixture(scope="module")
def record(make_trials, base):
    """The motion of the usual arm, which is that of the true one, with the torque of the true one's muscles."""
    record = make_record(make_trials(noise_deg=0.2), base).train
    simulation = Simulation(base, TRUE, record.emg, record.dt)
    motion = simulate(simulation, torch.tensor(0.6, dtype=torch.float64))
    position = torch.arange(record.angle.shape[1], dtype=torch.float64)[:, None, None]
    _, activation = simulation.activate(position)
    state = motion.q[..., None], motion.qdot[..., None]
    given = torques(simulation.valued_along(2), *state, activation, {}).driving[..., 0]
    return replace(record, torque=given.numpy())


def of(record, base, scatter):
    identify = {name: Identify(start_spread=0.0, low=50.0, high=1000.0) for name in ("f0_Bi", "f0_Tri")}
    fit = fit_model(base, record, free_parameters(base, identify, (), scatter))
    return Hypothesis.of(fit, View.of(fit))


def test_shown_parameters_are_those_that_motion_and_torque_give(record, base):
    known = {"mass": Scatter(relative=0.2)}
    with_it, without = (of(some, base, known).averaged for some in (record, replace(record, torque=None)))
    for name, value in TRUE.items():
        mean, error = with_it[name]
        assert mean == pytest.approx(value, rel=0.03) and error < 0.05 * value, name
        assert without[name][1] > 5 * error, "motion alone does not tell forces from masses"


def test_torque_of_recorded_trials_counts_where_the_next_one_is_chosen(record, base, effects):
    """Forces make up for a load in any motion; not where their torque was measured."""
    fit, load = of(record, base, {}).fit, effects["hand_load"]
    blind = replace(fit, record=replace(record, torque=None))
    proposals, unseen = propose_trials(Menu.of(fit), load), propose_trials(Menu.of(blind), load)
    assert proposals[0].now > 10 > 0.1 > unseen[0].now
    assert all(p.separation >= p.now for p in proposals)
