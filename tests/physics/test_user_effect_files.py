"""Users' own effect files: equals of those that ship, and refused with a reason when faulty."""

import pytest
import torch

from myowave.physics.effects import catalogue
from myowave.physics.model import parse_model
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation

HEADER = "import torch\nfrom myowave.physics.effect import Effect, Parameter\n"
TEMPLATE = (
    HEADER
    + """
def spring({arguments}):
    return {result}

EFFECT = Effect(
    name="{name}", acts_on="{stage}", equation="-k q^3", function=spring, source="test",
    parameters={{"k": Parameter(unit="N m", low={low}, high=5.0, typical=1.0, meaning="hardening spring")}},
)
"""
)


def write(path, *, name="hardening_spring", stage="joint", arguments="q, *, k", result="-k * q**3", low="0.0"):
    path.write_text(TEMPLATE.format(name=name, stage=stage, arguments=arguments, result=result, low=low))
    return path


def test_a_users_effect_is_used_like_one_that_ships(tmp_path, elbow, noisy_emg, dt):
    effects = catalogue([write(tmp_path / "spring.py")])
    model = parse_model("base+joint_damping+hardening_spring", elbow, effects)
    emg = noisy_emg[0.10][:1, :80]
    held = simulate(Simulation(model, {"hardening_spring.k": 2.0}, emg, dt), 1.0)
    free = simulate(Simulation(model, {}, emg, dt), 1.0)
    assert held.q[0, -20:].mean() < free.q[0, -20:].mean() - 0.01


def test_an_effect_that_raises_later_is_named_with_its_file(tmp_path, elbow, noisy_emg, dt):
    """Where a fit gets to, the trial on a small elbow never was."""
    path = write(tmp_path / "spring.py", result="-k * q**3 if q.abs().max() < 9 else int('far')")
    model = parse_model("base+hardening_spring", elbow, catalogue([path]))
    with pytest.raises(ValueError, match=r"spring.py: effect 'hardening_spring' raised ValueError: invalid literal"):
        simulate(Simulation(model, {"hardening_spring.k": 2.0}, noisy_emg[0.10][:1, :80], dt), 9.5)


def test_a_file_may_hold_several_effects(tmp_path):
    path = write(tmp_path / "two.py")
    other = TEMPLATE.format(name="other", stage="joint", arguments="qdot, *, k", result="-k * qdot", low="0.0")
    path.write_text(path.read_text() + other.removeprefix(HEADER).replace("EFFECT", "OTHER").replace("spring", "drag"))
    assert {"hardening_spring", "other"} <= set(catalogue([path]))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"result": "-k * q**3 + 0.5"}, "0 must mean no effect"),
        ({"result": "-torch.sqrt(k) * q"}, "derivative by hardening_spring.k at 0 is not finite"),
        ({"result": "k * torch.log(1.5 - k) * q"}, "not finite"),
        ({"arguments": "activation, *, k", "result": "k * activation"}, "shape|raised"),
        ({"arguments": "q, muscle, *, k"}, "asks for \\['muscle'\\]"),
        ({"result": "spring_constant * q"}, "NameError"),
        ({"low": "0.1"}, "must hold 0"),
        ({"name": "joint_damping"}, "taken"),
        ({"name": "damping_of_the_joint"}, "has the title of joint_damping, 'damping of the joint'; give it words"),
        ({"stage": "constants", "arguments": "mass, *, k", "result": "{'weight': mass + k}"}, "weight.*not constants"),
        ({"result": "__import__('sys').exit(0)"}, "raised SystemExit: 0"),
        ({"result": "None"}, "raised TypeError"),
        ({"result": "'text'"}, "raised TypeError"),
        ({"result": "spring(q, k=k)"}, "raised RecursionError"),
        ({"low": "float('-inf')"}, "bounds .-inf, 5.0. must be finite"),
        ({"low": "float('nan')"}, "bounds .nan, 5.0. must be finite"),
        ({"low": "'0'"}, "line 9: .*TypeError"),
        ({"name": "kr\u00e4ftig"}, "identifier of ASCII letters"),
        ({"name": "two+effects"}, "identifier of ASCII letters"),
        ({"stage": "elbow"}, "acts_on is 'elbow'; expected one of"),
    ],
)
def test_a_faulty_effect_is_refused_with_the_file_and_the_reason(changes, message, tmp_path):
    path = write(tmp_path / "faulty.py", **changes)
    with pytest.raises(ValueError, match=message) as refused:
        catalogue([path])
    assert "faulty.py" in str(refused.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("EFFECT = 3\n", "holds no Effect"),
        ("x = 1\nraise RuntimeError('boom')\n", "line 2: .*RuntimeError: boom"),
        ("def f(:\n", "line 1: .*SyntaxError"),
        ("import sys\nsys.exit(0)\n", "line 2: .*raised SystemExit: 0. Correct the file there"),
        ("exit()\n", "line 1: .*raised SystemExit"),
        ("import no_such_package\n", "line 1: .*ModuleNotFoundError: No module named 'no_such_package'"),
        ("", "holds no Effect"),
        ("x = 1\0\n", "raised (ValueError|SyntaxError): source code string cannot contain null bytes"),
        ("x = '\udcff'\n", "SyntaxError.*utf-8"),
    ],
)
def test_a_file_without_a_usable_effect_is_refused(text, message, tmp_path):
    path = tmp_path / "broken.py"
    path.write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(ValueError, match=message) as refused:
        catalogue([path])
    assert "broken.py" in str(refused.value)


def test_a_file_that_is_no_python_by_its_name_is_refused(tmp_path):
    path = write(tmp_path / "spring.txt")
    with pytest.raises(ValueError, match="spring.txt: .*name that ends in .py"):
        catalogue([path])
    (tmp_path / "folder.py").mkdir()
    with pytest.raises(ValueError, match="folder.py: no such effect file"):
        catalogue([tmp_path / "folder.py"])


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ValueError, match="no such effect file.*physics.effect_files"):
        catalogue([tmp_path / "absent.py"])


def test_a_mean_over_trials_would_mix_trials_and_is_not_mistaken_for_a_torque(tmp_path):
    path = write(tmp_path / "shape.py", result="(k * q).unsqueeze(-1)")
    with pytest.raises(ValueError, match="shape|raised"):
        catalogue([path])


def test_torch_stays_in_double_precision(tmp_path):
    effects = catalogue([write(tmp_path / "spring.py")])
    value = effects["hardening_spring"].function(torch.ones(2, dtype=torch.float64), k=torch.tensor(1.0))
    assert value.dtype == torch.float64
