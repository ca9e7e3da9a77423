"""`myowave subject`: settings that can be laid over config.yaml as they are."""

import pytest
from typer.testing import CliRunner

from myowave.cli import app
from myowave.physics.anthropometry import forearm_with_hand


def run(*arguments):
    return CliRunner().invoke(app, ["subject", *arguments])


def test_the_printed_settings_are_an_arm_with_the_persons_forearm(laid_over):
    done = run("--mass", "70", "--height", "1.75", "--sex", "f", "--name", "ann")
    joint = laid_over(done.stdout).physics.arms["ann"].joint
    expected = {name: e.value for name, e in forearm_with_hand(70, 1.75, "f").items()}
    assert [joint.mass_kg, joint.com_m, joint.inertia_kg_m2, joint.grip_m] == pytest.approx(
        list(expected.values()), rel=1e-3
    )
    assert done.stdout.count("# sd ") == 4 and "de Leva 1996" in done.stdout


@pytest.mark.parametrize(
    ("option", "value", "says"),
    [("--height", "175", "expected 1.2 to 2.3 m"), ("--name", "Ann B", "cannot be the name")],
)
def test_a_wrong_measure_ends_with_one_line(option, value, says):
    given = {"--mass": "70", "--height": "1.75", "--sex": "f", option: value}
    done = run(*(part for pair in given.items() for part in pair))
    assert done.exit_code == 2 and says in done.stderr and done.stderr.count("\n") == 1
