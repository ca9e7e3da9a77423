"""`myowave geometry`: tables of a model's paths that give its lengths and moment arms back.

The model has muscles on straight lines over a hinge, so the physics' own straight path says what is right. It is
sampled with a stand-in for OpenSim, and with OpenSim itself where that is installed.
"""

import math
import sys
import types
from pathlib import Path

import pytest
import torch
from typer.testing import CliRunner

from myowave.cli import app
from myowave.physics.path import StraightPath, read_path

RANGE = (0.0, math.radians(130))
L1, L2 = 0.30, 0.05
# On one line with the forearm at 0, in front or behind the hinge; DELT does not cross it.
SIDES = {"BIC.l": 1.0, "TRI": -1.0, "DELT": 0.0}


def expected(side, q):
    return StraightPath(L1, L2, side).length_and_arm(torch.as_tensor(q, dtype=torch.float64))


class Members(list):
    getSize = list.__len__
    get = list.__getitem__


class Named:
    def __init__(self, name):
        self.name = name

    def getName(self):
        return self.name


class Coordinate(Named):
    value = 0.0

    def getMotionType(self):
        return 1 if self.name == "elbow" else 2

    def getRangeMin(self):
        return RANGE[0]

    def getRangeMax(self):
        return RANGE[1]

    def setLocked(self, state, locked):
        pass

    def setValue(self, state, value):
        state["elbow"] = value


class Muscle(Named):
    getMaxIsometricForce = getOptimalFiberLength = getTendonSlackLength = lambda self: 0.2
    getPennationAngleAtOptimalFiberLength = lambda self: 0.1  # noqa: E731
    getMaxContractionVelocity = lambda self: 10.0  # noqa: E731

    def getLength(self, state):
        return float(expected(SIDES[self.name], state["elbow"])[0])

    def computeMomentArm(self, state, coordinate):
        return float(expected(SIDES[self.name], state["elbow"])[1])


class Model:
    def __init__(self, path):
        if Path(path).read_text() != "model":
            raise RuntimeError("not a model\nThrown at somewhere")

    def initSystem(self):
        return {"elbow": 0.0}

    def realizePosition(self, state):
        pass

    def getCoordinateSet(self):
        return Members([Coordinate("slide"), Coordinate("elbow")])

    def getMuscles(self):
        return Members(map(Muscle, SIDES))


def stand_in(path, monkeypatch):
    path.write_text("model")
    logger = types.SimpleNamespace(removeFileSink=lambda: None, setLevelString=lambda level: None)
    stub = types.SimpleNamespace(Model=Model, Coordinate=types.SimpleNamespace(Rotational=1), Logger=logger)
    monkeypatch.setitem(sys.modules, "opensim", stub)


def real(path, monkeypatch):
    import opensim

    model = opensim.Model()
    forearm = opensim.Body("forearm", 1.5, opensim.Vec3(0, -0.2, 0), opensim.Inertia(0.02, 0.001, 0.02))
    model.addBody(forearm)
    no = opensim.Vec3(0)
    for kind, name in ((opensim.SliderJoint, "slide"), (opensim.PinJoint, "elbow")):
        body = forearm if name == "elbow" else opensim.Body(name, 1.0, no, opensim.Inertia(1))
        if name == "slide":
            model.addBody(body)
        joint = kind(f"{name}_joint", model.getGround(), no, no, body, no, no)
        joint.updCoordinate().setName(name)
        joint.updCoordinate().setRangeMin(RANGE[0])
        joint.updCoordinate().setRangeMax(RANGE[1])
        model.addJoint(joint)
    for name, side in SIDES.items():
        muscle = opensim.Thelen2003Muscle(name, 0.2, 0.2, 0.2, 0.1)
        muscle.addNewPathPoint("origin", model.getGround(), opensim.Vec3(0, L1, 0))
        end = forearm if side else model.getGround()
        muscle.addNewPathPoint("insertion", end, opensim.Vec3(0, -side * L2, 0))
        model.addForce(muscle)
    model.finalizeConnections()
    model.printToXML(str(path))


@pytest.fixture(params=[stand_in, pytest.param(real, marks=pytest.mark.opensim)])
def model(request, workplace, monkeypatch):
    request.param(workplace / "mine.osim", monkeypatch)
    return lambda *options: CliRunner().invoke(
        app, ["geometry", "mine.osim", "--coordinate", "elbow", "--output", "paths", *options]
    )


def test_a_table_gives_the_models_lengths_and_moment_arms_back(model):
    done = model()
    assert done.exit_code == 0 and "differs" not in done.stdout
    q = torch.linspace(*RANGE, 50, dtype=torch.float64)
    for name, side in (("BIC_l", 1.0), ("TRI", -1.0)):
        length, arm = read_path("paths/path_lengths.csv", name).length_and_arm(q)
        assert torch.allclose(length, expected(side, q)[0], atol=1e-5)
        assert torch.allclose(arm, expected(side, q)[1], atol=5e-4)


def test_the_settings_are_an_arm_of_these_muscles(model, laid_over):
    assert model("--name", "mine").exit_code == 0
    arm = laid_over(Path("paths/arm.yaml").read_text()).physics.arms["mine"]
    assert {name: (m.side, m.emg, m.group) for name, m in arm.muscles.items()} == {
        "BIC_l": ("flexor", "emg_biceps", "flexors"),
        "TRI": ("extensor", "emg_triceps", "extensors"),
    }
    muscle = arm.muscles["TRI"]
    assert (muscle.f0_N, muscle.l0_m, muscle.vmax_m_s, muscle.pennation_rad) == pytest.approx((0.2, 0.2, 2.0, 0.1))


def test_a_table_too_coarse_for_its_path_is_said(model):
    done = model("--step", "45")
    assert done.exit_code == 0 and "the table's differs from the model's by up to" in done.stdout


def test_a_falling_coordinate_is_turned_round(model):
    done = model("--sign", "-1")
    assert done.exit_code == 0 and "differs" not in done.stdout
    path = read_path("paths/path_lengths.csv", "TRI")
    q = torch.linspace(-RANGE[1], 0, 20, dtype=torch.float64)
    assert path.range == pytest.approx((-RANGE[1], 0.0)) and torch.allclose(
        path.length_and_arm(q)[1], -expected(-1.0, -q)[1], atol=5e-4
    )


def test_named_muscles_only_and_finer_steps_where_asked_for(model):
    done = model("--muscles", "TRI", "--step", "1")
    rows = Path("paths/path_lengths.csv").read_text().splitlines()
    assert done.exit_code == 0 and len(rows) == 132 and all(row.startswith("TRI,") for row in rows[1:])


def test_nothing_else_is_left_behind(model, workplace):
    model()
    assert not list(workplace.glob("*.log"))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--coordinate", "elbw"], "there is no coordinate 'elbw'; did you mean 'elbow'?"),
        (["--coordinate", "slide"], "coordinate slide is no angle"),
        (["--muscles", "TRIC"], "there is no muscle 'TRIC'; did you mean 'TRI'?"),
        (["--step", "0"], "--step is 0"),
        (["--sign", "2"], "--sign is 2"),
        (["--name", "my arm"], "cannot be the name of the arm"),
    ],
)
def test_a_mistake_ends_with_one_line(model, options, says):
    done = model(*options)
    assert done.exit_code == 2 and says in done.stderr and done.stderr.count("\n") == 1 and not Path("paths").exists()


def test_a_file_that_is_no_model_is_refused(model):
    Path("mine.osim").write_text("<a/>")
    done = model()
    assert done.exit_code == 2 and "mine.osim: OpenSim cannot read it as a model" in done.stderr


def test_without_opensim_it_says_how_to_install_it(workplace, monkeypatch):
    monkeypatch.setitem(sys.modules, "opensim", None)
    done = CliRunner().invoke(app, ["geometry", "a.osim", "--coordinate", "elbow", "--output", "paths"])
    assert done.exit_code == 2 and "need the package opensim: pip install 'myowave[opensim]'" in done.stderr
