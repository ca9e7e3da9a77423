"""The forearm as a point mass or a rigid body, from the constants and from the configuration."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch
import yaml

from myowave.models import build_model
from myowave.physics.dynamics import torques
from myowave.physics.effects import SHIPPED, catalogue
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation
from myowave.physics.trajectory import solve
from myowave.physics.valued import give_values
from myowave.settings import parse_settings

ROOT = Path(__file__).parents[2]
DOUBLE = torch.float64
MASS, LENGTH = 1.4, 0.8
POINT = {"mass": MASS, "length": LENGTH, "load": 0.0, "tilt": 0.0}
AS_BODY = {"mass": MASS, "com": LENGTH, "inertia": MASS * LENGTH**2, "grip": LENGTH, "load": 0.0, "tilt": 0.0}
ROD = {"mass": MASS, "com": LENGTH / 2, "inertia": MASS * LENGTH**2 / 3, "grip": LENGTH, "load": 0.0, "tilt": 0.0}


def test_a_point_mass_moves_as_the_rigid_body_that_it_is(elbow, noisy_emg, dt):
    emg, params = noisy_emg[0.10][:2, :40], {"load": torch.tensor([0.0, 0.6]), "tilt": 0.2}
    point, body = (simulate(Simulation(replace(elbow, joint=j), params, emg, dt), 1.0).q for j in (POINT, AS_BODY))
    torch.testing.assert_close(body, point, rtol=0, atol=1e-10)


def test_a_uniform_rod_is_half_its_mass_at_its_end_with_a_third_less_inertia(elbow, noisy_emg, dt):
    """Weight m g l / 2 and inertia m l^2 / 3; gravity's effects and loads act on either in the same way."""
    effects = [catalogue()[name] for name in ("forearm_inertia", "gravity_tilt", "hand_load")]
    emg, shared = noisy_emg[0.10][:2, :40], {"load": 0.5, "gravity_tilt.phi": 0.2, "hand_load.m": 0.1}
    half = replace(elbow, joint=POINT | {"mass": MASS / 2}).with_effects(effects)
    rod = replace(elbow, joint=ROD).with_effects(effects)
    one = simulate(Simulation(half, shared | {"forearm_inertia.r": -1 / 3}, emg, dt), 1.0).q
    other = simulate(Simulation(rod, shared, emg, dt), 1.0).q
    torch.testing.assert_close(other, one, rtol=0, atol=1e-10)


def test_the_inertia_of_a_rigid_body_is_that_of_its_kinetic_energy(elbow):
    """A rod cut into many points, and a load at the grip: sum of m r^2, and its slope in height is gravity's torque."""
    rod = replace(elbow, joint=ROD | {"grip": 0.7})
    r = (torch.arange(4000, dtype=DOUBLE) + 0.5) / 4000 * LENGTH
    m, load, q = MASS / 4000, 0.6, torch.tensor([0.3, 1.4], dtype=DOUBLE)
    valued = give_values(rod, {"load": load}, q)
    found = torques(valued, q, torch.zeros(2, dtype=DOUBLE), torch.zeros(2, 2, dtype=DOUBLE), {})
    expected = (m * r**2).sum() + load * 0.7**2
    torch.testing.assert_close(found.inertia, expected.expand(1), rtol=1e-6, atol=0)
    weight = 9.80665 * ((m * r).sum() + load * 0.7)
    torch.testing.assert_close(found.gravity, -weight * torch.sin(q), rtol=1e-6, atol=0)


def test_derivatives_by_the_constants_of_a_rigid_body_are_those_of_the_motion(elbow, noisy_emg, dt):
    model, emg = replace(elbow, joint=ROD), noisy_emg[0.10][:1, :15]
    start = torch.tensor([1.0], dtype=DOUBLE), torch.zeros(1, dtype=DOUBLE)
    wrt = {name: 0.3 for name in ("mass", "com", "inertia", "grip", "load")}
    found = solve(Simulation(model, {"load": 0.5}, emg, dt), *start, wrt=wrt)
    for derivative, name in zip(found.by_parameter, wrt, strict=True):
        value = {"load": 0.5}.get(name, model.defaults[name])
        low, high = (
            simulate(Simulation(model, {"load": 0.5, name: value + step}, emg, dt), *start).angle
            for step in (-1e-5, 1e-5)
        )
        torch.testing.assert_close(derivative, (high - low) / 2e-5, rtol=1e-3, atol=1e-5)


def test_every_effect_acts_on_a_rigid_body(elbow):
    rod = replace(elbow, joint=ROD)
    assert not [effect.name for effect in SHIPPED if rod.refuses(effect)]


# ---- from the configuration


def section(joint):
    config = yaml.safe_load((ROOT / "config.yaml").read_text())
    config["physics"]["arms"]["paper"]["joint"] = joint
    return parse_settings(config).physics.of_arm("paper")


def test_the_configuration_has_a_point_mass_or_a_rigid_body():
    point, body = (
        {"mass_kg": 1.4, "length_m": 0.8},
        {"mass_kg": 1.5, "com_m": 0.2, "inertia_kg_m2": 0.07, "grip_m": 0.3},
    )
    for written, names in ((point, {"length"}), (body, {"com", "inertia", "grip"})):
        physics = section(written)
        model = build_model("base", physics)
        assert set(model.joint) == names | {"mass", "load", "tilt", "motor", "braking", "drive"}
        assert set(physics.nominal) == set(model.defaults)
    assert model.defaults["inertia"] == 0.07 and model.defaults["load"] == 0.0


@pytest.mark.parametrize(
    ("joint", "says"),
    [
        ({"mass_kg": 1.5}, "joint: give length_m .* or com_m, inertia_kg_m2 and grip_m"),
        ({"mass_kg": 1.5, "com_m": 0.2, "grip_m": 0.3}, "joint: give length_m"),
        ({"mass_kg": 1.5, "length_m": 0.3, "grip_m": 0.3}, "joint: give length_m"),
        ({"mass_kg": 1.5, "com_m": 0.2, "inertia_kg_m2": 0.02, "grip_m": 0.3}, "is 0.02, but about the elbow .* 0.06"),
    ],
)
def test_a_forearm_that_is_neither_is_refused(joint, says):
    with pytest.raises(ValueError, match=says):
        section(joint)
