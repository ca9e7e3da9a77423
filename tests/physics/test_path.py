"""Paths of muscles over the joint: virtual work on every kind, tables against OpenSim, models that mix both."""

import copy
import csv
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import yaml

from myowave.models import build_model
from myowave.physics.dynamics import muscle_quantities
from myowave.physics.effects import SHIPPED, catalogue
from myowave.physics.motion import simulate
from myowave.physics.muscle import EXTENSOR, FLEXOR
from myowave.physics.path import SideBySide, StraightPath, TablePath, read_path
from myowave.physics.simulation import Simulation
from myowave.physics.trajectory import solve
from myowave.physics.valued import along, give_values
from myowave.settings import parse_settings

ROOT = Path(__file__).parents[2]
ARM26 = ROOT / "data/arm26/path_lengths.csv"
MUSCLES = ("TRIlong", "TRIlat", "TRImed", "BIClong", "BICshort", "BRA")
DOUBLE = torch.float64
LENGTHS = 0.3 - 0.02 * np.sin(np.linspace(0, 2, 9))
UNEVEN = np.array([0.0, 0.1, 0.4, 0.5, 0.9, 1.3, 1.4, 1.8, 2.0])


def arm26(muscle):
    """Angle [rad], length and OpenSim's moment arm [m]."""
    rows = [row for row in csv.DictReader(ARM26.read_text().splitlines()) if row["muscle"] == muscle]
    angle, length, arm = (np.array([float(r[c]) for r in rows]) for c in ("angle_deg", "length_m", "moment_arm_m"))
    return np.radians(angle), length, arm


def a_table():
    return TablePath.through(*arm26("BRA")[:2])


PATHS = {
    "straight flexor": StraightPath(0.3, 0.8, FLEXOR),
    "straight extensor": StraightPath(0.2, 0.7, EXTENSOR),
    "table": a_table(),
    "scaled table": replace(a_table(), scale=1.3),
    "uneven table": TablePath.through(UNEVEN, LENGTHS),
}


@pytest.mark.parametrize("name", PATHS)
def test_the_moment_arm_does_the_virtual_work_of_the_length_at_any_angle(name):
    q = torch.from_numpy(
        np.random.default_rng(7).uniform(-0.5, 3.0, 200)
    ).requires_grad_()  # also overextended, and beyond the tables
    length, arm = PATHS[name].length_and_arm(q)
    (slope,) = torch.autograd.grad(length.sum(), q)
    torch.testing.assert_close(arm, -slope, rtol=1e-12, atol=1e-15)
    assert arm.std() > 0


@pytest.mark.parametrize("muscle", MUSCLES)
def test_a_spline_through_the_lengths_has_opensims_moment_arms(muscle):
    angle, length, arm = arm26(muscle)
    path = read_path(str(ARM26), muscle)
    found_length, found_arm = path.length_and_arm(torch.from_numpy(angle))
    np.testing.assert_allclose(found_length, length, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found_arm, arm, rtol=0, atol=3e-4)


def test_a_table_of_a_straight_path_is_that_path():
    straight = PATHS["straight flexor"]
    knots, between = (torch.linspace(0.2, 2.2, n, dtype=DOUBLE) for n in (41, 1001))
    table = TablePath.through(knots, straight.length_and_arm(knots)[0])
    for one, other, atol in zip(
        table.length_and_arm(between), straight.length_and_arm(between), (1e-7, 1e-5), strict=True
    ):
        torch.testing.assert_close(one, other, rtol=0, atol=atol)


@pytest.mark.parametrize("angle", [UNEVEN, np.linspace(0.0, 2.0, 9)])
def test_a_path_goes_through_its_table_and_on_with_the_moment_arm_of_the_end(angle):
    path = TablePath.through(angle, LENGTHS)
    assert path.range == (0.0, 2.0)
    length, _ = path.length_and_arm(torch.from_numpy(angle))
    np.testing.assert_allclose(length, LENGTHS, rtol=0, atol=1e-6)
    for end, out in ((0.0, -1), (2.0, 1)):
        q = end + out * torch.tensor([0.0, 0.1, 1.0], dtype=DOUBLE)
        length, arm = path.length_and_arm(q)
        torch.testing.assert_close(arm, arm[:1].expand(3), rtol=0, atol=1e-12)
        torch.testing.assert_close(length, length[0] - arm[0] * (q - end), rtol=0, atol=1e-12)


def test_paths_are_equal_only_if_they_are_the_same():
    assert StraightPath(0.3, 0.8, FLEXOR) == PATHS["straight flexor"] != PATHS["straight extensor"]
    assert PATHS["table"] == PATHS["table"] != PATHS["uneven table"]


def test_an_angle_that_is_not_a_number_gives_a_length_that_is_none():
    length, arm = PATHS["table"].length_and_arm(torch.tensor([math.nan, 1.0], dtype=DOUBLE))
    assert length.isnan().tolist() == arm.isnan().tolist() == [True, False]


def test_a_scale_acts_on_length_and_moment_arm():
    q = torch.linspace(-0.5, 3.0, 50, dtype=DOUBLE)
    for plain, scaled in zip(PATHS["table"].length_and_arm(q), PATHS["scaled table"].length_and_arm(q), strict=True):
        torch.testing.assert_close(scaled, 1.3 * plain)


# ---- in a model


@pytest.fixture(scope="module")
def mixed(elbow):
    """The biceps with a table of its straight path, the triceps straight."""
    biceps, triceps = elbow.muscles
    q = torch.linspace(-0.5, 3.0, 141, dtype=DOUBLE)
    table = TablePath.through(q, biceps.path.length_and_arm(q)[0])
    return replace(elbow, muscles=(replace(biceps, path=table), triceps))


def test_a_model_may_mix_kinds_of_paths_and_moves_alike(elbow, mixed, noisy_emg, dt):
    assert {"scale_Bi", "l1_Tri"} < set(mixed.defaults) and not {"l1_Bi", "scale_Tri"} & set(mixed.defaults)
    emg = noisy_emg[0.10][:2, :30]
    straight, other = (simulate(Simulation(m, {}, emg, dt), 1.0).q for m in (elbow, mixed))
    torch.testing.assert_close(other, straight, rtol=0, atol=1e-6)


def test_paths_side_by_side_are_those_of_each_muscle_in_any_batch(mixed):
    scale, l1 = torch.tensor([[1.1], [0.9]], dtype=DOUBLE), torch.tensor([0.2, 0.21, 0.22], dtype=DOUBLE)
    q = torch.linspace(0.1, 2.0, 2 * 3 * 7, dtype=DOUBLE).reshape(2, 3, 7)
    valued = give_values(mixed, along({"scale_Bi": scale, "l1_Tri": l1}, 1, q), q)
    assert isinstance(valued.path, SideBySide)
    found = muscle_quantities(valued, q, torch.zeros_like(q), torch.zeros(*q.shape, 2, dtype=DOUBLE))["moment_arm"]
    table, triceps = mixed.muscles[0].path, replace(mixed.muscles[1].path, l1=l1[:, None])
    torch.testing.assert_close(found[..., 0], scale[..., None] * table.length_and_arm(q)[1], rtol=0, atol=1e-15)
    torch.testing.assert_close(found[..., 1], triceps.length_and_arm(q)[1], rtol=0, atol=1e-15)


def test_tables_side_by_side_are_those_of_each_muscle_on_its_own():
    """Though each has other angles and another number of cells; straight beyond its own ends."""
    tables = [PATHS["table"], PATHS["uneven table"], TablePath.through(*arm26("TRIlong")[:2])]
    scales = torch.tensor([[1.0, 0.9, 1.2], [1.1, 1.0, 0.8]], dtype=DOUBLE)
    q = torch.linspace(-1.0, 4.0, 2 * 50, dtype=DOUBLE).reshape(50, 2).mT
    q[0, 0] = math.nan
    angle = q.expand(3, 2, 50).contiguous().movedim(0, -1)
    found = TablePath.side_by_side(tables, {"scale": scales[:, None]}).length_and_arm(angle)
    for i, table in enumerate(tables):
        alone = replace(table, scale=scales[:, i, None]).length_and_arm(q)
        for one, of_all in zip(alone, found, strict=True):
            torch.testing.assert_close(of_all[..., i], one, rtol=0, atol=0, equal_nan=True)


def test_an_arm_whose_muscles_all_have_tables_looks_them_up_at_once(elbow):
    muscles = [replace(m, path=table) for m, table in zip(elbow.muscles, [PATHS["table"]] * 2, strict=True)]
    q = torch.linspace(0.1, 2.0, 9, dtype=DOUBLE)
    valued = give_values(replace(elbow, muscles=tuple(muscles)), {"scale_Tri": 1.2}, q)
    assert isinstance(valued.path, TablePath)
    found = muscle_quantities(valued, q, torch.zeros_like(q), torch.zeros(9, 2, dtype=DOUBLE))["moment_arm"]
    arm = PATHS["table"].length_and_arm(q)[1]
    torch.testing.assert_close(found, torch.stack([arm, 1.2 * arm], -1), rtol=0, atol=1e-15)


def test_motion_with_tables_has_the_derivatives_of_the_simulated_motion(mixed, noisy_emg, dt):
    emg = noisy_emg[0.10][:2, :15]
    start = torch.tensor([1.0, 0.9], dtype=DOUBLE), torch.zeros(2, dtype=DOUBLE)
    found = solve(Simulation(mixed, {}, emg, dt), *start, wrt={"scale_Bi": 1.0, "l1_Tri": 0.2})

    def moved(name, value):
        return simulate(Simulation(mixed, {name: value}, emg, dt), *start).angle

    for derivative, (name, value) in zip(found.by_parameter, {"scale_Bi": 1.0, "l1_Tri": 0.2}.items(), strict=True):
        difference = (moved(name, value + 1e-5) - moved(name, value - 1e-5)) / 2e-5
        assert derivative.abs().max() > 0.01
        torch.testing.assert_close(derivative, difference, rtol=1e-3, atol=1e-4)


def test_an_effect_that_needs_a_straight_path_says_so_when_the_model_is_made(mixed):
    with pytest.raises(ValueError, match="'brachialis' needs l1, l2, which muscle Bi with a table path does not have"):
        mixed.with_effects([catalogue()["brachialis"]])


def test_every_other_effect_acts_on_a_model_with_tables(mixed, noisy_emg, dt):
    others = [effect for effect in SHIPPED if not mixed.refuses(effect)]
    assert {e.name for e in SHIPPED} - {e.name for e in others} == {"brachialis"}
    simulation = Simulation(mixed.with_effects(others), {"moment_arm_offset.d_Bi": 0.01}, noisy_emg[0.10][:1, :5], dt)
    assert simulate(simulation, 1.0).angle.isfinite().all()


# ---- from the configuration


@pytest.fixture(scope="module")
def config():
    return yaml.safe_load((ROOT / "config.yaml").read_text())


def with_path(config, path, **changed):
    """The physics of the paper's arm with another path of the biceps."""
    config = copy.deepcopy(config)
    muscles = config["physics"]["arms"]["paper"]["muscles"]
    straight = {k: v for k, v in muscles["Bi"].items() if k not in ("l1_m", "l2_m")}
    muscles["Bi"] = straight | changed | ({} if path is None else {"path": path})
    return parse_settings(config).physics.of_arm("paper")


def test_a_table_of_the_configuration_is_a_path_and_a_file_that_the_model_is_made_of(config):
    physics = with_path(config, {"file": str(ARM26), "muscle": "BRA"})
    assert physics.files == (str(ARM26),) and {"scale_Bi", "l1_Tri"} < set(physics.nominal)
    model = build_model("base", physics)
    assert model.defaults["scale_Bi"] == 1.0 and model.defaults == pytest.approx(physics.nominal)
    assert parse_settings(config).physics.of_arm("paper").files == ()


@pytest.mark.parametrize(
    ("path", "changed", "says"),
    [
        (None, {}, "Bi: give l1_m and l2_m .*or a section path"),
        (None, {"l1_m": 0.3}, "Bi: give l1_m and l2_m"),
        ({"file": "a.csv"}, {"l1_m": 0.3, "l2_m": 0.8}, "Bi: give l1_m and l2_m"),
        ({"l1_m": 0.3, "l2_m": 0.8}, {}, "Bi.path.l1_m: unknown key"),
        (None, {"l1_m": 0, "l2_m": 0.8}, r"Bi.l1_m = 0: expected a number or null, at least 0.001"),
        ({}, {}, "Bi.path.file: is missing"),
    ],
)
def test_a_path_that_is_not_one_is_refused(path, changed, says, config):
    with pytest.raises(ValueError, match=says):
        with_path(config, path, **changed)


def table(*rows, header="angle_deg,length_m"):
    return "\n".join([header, *rows]) + "\n"


GOOD = ("0,0.30", "10,0.29", "20,0.28", "30,0.27")


@pytest.mark.parametrize(
    ("text", "muscle", "says"),
    [
        (table(*GOOD[:3]), None, "has 3 rows; a path needs at least 4"),
        (table(GOOD[0], GOOD[2], GOOD[1], GOOD[3]), None, "line 4: angle_deg goes from 20 to 10; angles must increase"),
        (table(GOOD[0], *GOOD), None, "line 3: angle_deg goes from 0 to 0"),
        (table(*GOOD[:3], "30,nan"), None, "line 5: length_m is 'nan'; expected a number"),
        (table(*GOOD[:3], "30"), None, "line 5: has fewer values than the table has columns"),
        (table(*(f"{r},Bi" for r in GOOD), "40,0.26", header="angle_deg,length_m,muscle"), "BRA", "line 6: has fewer"),
        (table("-90,0.3", "1,0.29", "2,0.28", "3,0.27", header="angle_rad,length_m"), None, "line 2: angle_rad is -90"),
        (table(*GOOD[:3], "x,0.27"), None, "line 5: angle_deg is 'x'; expected a number"),
        (table(*GOOD[:3], "30,-0.27"), None, "line 5: length_m is -0.27; expected above 0, at most 5 m"),
        (table(*GOOD, header="angle,length_m"), None, "expected one of angle_deg and angle_rad.*found angle, length_m"),
        (table(*GOOD, header="angle_deg,arm_m"), None, "and length_m; found angle_deg, arm_m"),
        (table(*GOOD), "BRA", "has no column muscle"),
        (table(*(f"{r},BRA" for r in GOOD), header="angle_deg,length_m,muscle"), None, "say which with path.muscle"),
        (table(*(f"{r},BRA" for r in GOOD), header="angle_deg,length_m,muscle"), "Bi", "no rows of muscle 'Bi'.*BRA"),
        ("", None, "expected one of angle_deg"),
    ],
)
def test_a_faulty_table_is_explained(text, muscle, says, tmp_path):
    file = tmp_path / "path.csv"
    file.write_text(text)
    with pytest.raises(ValueError, match=f"^{re.escape(str(file))}.*{says}"):
        read_path(str(file), muscle)


def test_a_missing_table_is_explained(tmp_path):
    with pytest.raises(ValueError, match=r"no such table of a muscle's path; correct the muscle's path.file"):
        read_path(str(tmp_path / "none.csv"))


def test_a_table_of_the_other_side_is_refused(config):
    path = {"file": str(ARM26), "muscle": "TRIlat"}
    with pytest.raises(ValueError, match=r"muscle Bi: with flexion, the length .* but a flexor gets shorter"):
        build_model("base", with_path(config, path))
