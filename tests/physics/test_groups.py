"""Groups of muscles: one factor for all of them does what the same factor on each would do."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch
import yaml

from myowave.models import build_model
from myowave.physics.constants import GROUP_CONSTANTS, constant_of
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation
from myowave.physics.trajectory import solve
from myowave.physics.valued import give_values
from myowave.settings import parse_settings

ROOT = Path(__file__).parents[2]
CONFIG = yaml.safe_load((ROOT / "config.yaml").read_text())
DOUBLE = torch.float64
START = torch.tensor([1.2, 0.9], dtype=DOUBLE), torch.tensor([0.0, 0.2], dtype=DOUBLE)
FLEXORS, EXTENSORS = ("BIClong", "BICshort", "BRA"), ("TRIlong", "TRIlat", "TRImed")


@pytest.fixture(scope="module")
def arm26():
    return build_model("base", parse_settings(CONFIG).physics.of_arm("arm26"))


@pytest.fixture(scope="module")
def emg(arm26, noisy_emg):
    """EMG of the biceps for each flexor and of the triceps for each extensor, (2, 15, 6)."""
    channels = [0 if m.side > 0 else 1 for m in arm26.muscles]
    return 0.3 * noisy_emg[0.10][:2, :15, channels].clamp(min=0.0)


@pytest.mark.parametrize(
    ("factor", "scaled"), [("strength", ("f0",)), ("length", ("l0", "slack", "vmax"))], ids=["strength", "length"]
)
def test_a_factor_of_a_group_is_that_factor_on_each_of_its_muscles_and_on_no_other(factor, scaled, arm26, emg):
    each = {f"{c}_{m}": 0.9 * arm26.defaults[f"{c}_{m}"] for c in scaled for m in FLEXORS}
    one, other = (simulate(Simulation(arm26, p, emg, 0.01), *START).q for p in ({f"{factor}_flexors": 0.9}, each))
    torch.testing.assert_close(one, other, rtol=0, atol=1e-12)
    assert (one - simulate(Simulation(arm26, {}, emg, 0.01), *START).q).abs().max() > 1e-4


def test_what_an_electrode_does_wrong_is_one_number_for_all_muscles_that_share_it(arm26, emg, effects):
    def moved(model, params, emg):
        return simulate(Simulation(model, params, emg + 0.1, 0.01), *START).q

    offset = arm26.with_effects([effects["emg_offset"]])
    names = offset.with_effects([effects["moment_arm_offset"]]).effect_parameters
    offsets = [f"emg_offset.b_{channel}" for channel in ("emg_triceps", "emg_biceps")]
    assert list(names) == offsets + [f"moment_arm_offset.d_{m.name}" for m in arm26.muscles]
    of_biceps = torch.tensor([0.05 * (m.name in FLEXORS) for m in arm26.muscles], dtype=DOUBLE)
    torch.testing.assert_close(
        moved(offset, {offsets[1]: 0.05}, emg), moved(arm26, {}, emg - of_biceps), rtol=0, atol=1e-12
    )


def test_factors_of_a_batch_are_those_of_each_copy_and_trial(arm26, emg):
    copies = torch.tensor([[0.8], [1.0], [1.3]], dtype=DOUBLE)
    trials = torch.tensor([0.95, 1.05], dtype=DOUBLE)
    q = simulate(Simulation(arm26, {"strength_flexors": copies, "length_extensors": trials}, emg, 0.01), *START).q
    for i, strength in enumerate((0.8, 1.0, 1.3)):
        for j, length in enumerate((0.95, 1.05)):
            params = {"strength_flexors": strength, "length_extensors": length}
            alone = simulate(Simulation(arm26, params, emg[j : j + 1], 0.01), *(x[j : j + 1] for x in START)).q
            torch.testing.assert_close(q[i, j], alone[0], rtol=0, atol=1e-12)


def test_motion_has_the_derivatives_of_the_simulated_motion_by_every_factor(arm26, emg):
    wrt = {f"{c}_{group}": 1.0 for c in GROUP_CONSTANTS for group in arm26.groups}
    assert not any(arm26.drives(name) for name in wrt)
    found = solve(Simulation(arm26, {}, emg, 0.01), *START, wrt=wrt)
    for name, derivative in zip(wrt, found.by_parameter, strict=True):
        ahead, behind = (simulate(Simulation(arm26, {name: v}, emg, 0.01), *START).q for v in (1 + 1e-5, 1 - 1e-5))
        assert derivative.abs().max() > 1e-3, name
        torch.testing.assert_close(derivative, (ahead - behind) / 2e-5, rtol=2e-3, atol=1e-5, msg=name)


def test_muscles_without_a_group_have_no_factor(elbow):
    assert elbow.groups == () and not any(name.startswith("strength") for name in elbow.defaults)
    biceps, triceps = elbow.muscles
    mixed = replace(elbow, muscles=(replace(biceps, group="front"), triceps))
    assert set(mixed.defaults) - set(elbow.defaults) == {"strength_front", "length_front"}
    valued = give_values(mixed, {"strength_front": 2.0}, torch.zeros(1, dtype=DOUBLE))
    assert valued.muscle["f0"].squeeze().tolist() == [600.0, 300.0]


def test_a_factor_is_a_constant_like_any_other(arm26):
    assert constant_of("strength_flexors").unit == "-" and constant_of("f0_BRA").unit == "N"
    assert constant_of("length_flexors").scales and constant_of("mass").unit == "kg"
    assert constant_of("length").unit == "m", "the forearm's, which no group has"
    arm = parse_settings(CONFIG).physics.arms["arm26"]
    assert set(arm.nominal) == set(arm26.defaults) and arm.groups == arm26.groups == ("extensors", "flexors")


# ---- the arm that ships


def test_the_arm_with_a_brachioradialis_is_the_other_one_and_that_muscle(arm26):
    arm = build_model("base", parse_settings(CONFIG).physics.of_arm("arm26_brd"))
    same = {name: value for name, value in arm.defaults.items() if "BRD" not in name and "brachio" not in name}
    assert same == arm26.defaults and arm.curves == arm26.curves
    (brd,) = arm.muscles[-1:]
    assert brd.channel == "emg_brachioradialis" and brd.group == "brachioradialis"
    q = torch.linspace(0.0, 2.8, 281, dtype=torch.float64)
    _, moment_arm = brd.path.length_and_arm(q)
    assert 0.07 <= moment_arm.max() <= 0.08, "Murray et al.: 7 to 8 cm"
    assert 100 <= torch.rad2deg(q[moment_arm.argmax()]) <= 110


def test_the_shipped_arm_has_the_values_of_its_source(arm26):
    table = (ROOT / "data/arm26/README.md").read_text().split("|---|")[-1].splitlines()[1:]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table if line.startswith("|")]
    assert [row[0] for row in rows] == [m.name for m in arm26.muscles] == [*EXTENSORS, *FLEXORS]
    for name, *values, vmax in rows:
        found = [arm26.defaults[f"{c}_{name}"] for c in ("f0", "l0", "slack", "pennation")]
        assert found == [float(value) for value in values]
        assert arm26.defaults[f"vmax_{name}"] == pytest.approx(float(vmax) * arm26.defaults[f"l0_{name}"])
    com, mass = arm26.defaults["com"], arm26.defaults["mass"]
    assert arm26.defaults["inertia"] == pytest.approx(0.0193 + mass * com**2, rel=1e-4)


def test_a_muscle_of_the_shipped_arm_can_be_driven_by_another_channel():
    changed = {"BRA": {"emg": "emg_brachioradialis", "group": "brachialis"}}
    arms = CONFIG["physics"]["arms"] | {"arm26": {"preset": "arm26", "muscles": changed}}
    physics = CONFIG["physics"] | {"arms": arms}
    arm = parse_settings(CONFIG | {"physics": physics}).physics.arms["arm26"]
    assert arm.muscles["BRA"].emg == "emg_brachioradialis" and arm.muscles["BRA"].f0_N == 987.26
    assert arm.channels == ("emg_triceps", "emg_biceps", "emg_brachioradialis")
    assert {"strength_brachialis", "strength_flexors"} < set(arm.nominal)


def test_a_channel_is_led_by_the_first_of_its_muscles(arm26):
    assert arm26.channels == tuple(arm26.leading) and set(arm26.channels) == {m.channel for m in arm26.muscles}
    names, sharing = [m.name for m in arm26.muscles], {}
    for muscle in arm26.muscles:
        sharing.setdefault(muscle.channel, []).append(muscle.name)
    assert any(len(of) > 1 for of in sharing.values())
    assert {c: m.name for c, m in arm26.leading.items()} == {c: min(of, key=names.index) for c, of in sharing.items()}
