"""Deliberate faults have their places in the code; `make mutants` puts them in and sees their tests fail."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import pytest

specification = importlib.util.spec_from_file_location("faults", Path(__file__).with_name("faults.py"))
faults = importlib.util.module_from_spec(specification)
specification.loader.exec_module(faults)

FAULT = faults.Fault("myowave.arm:Arm.torque", "g * sin(q)", "g * q", ("test_torque",))
SOUND = '''
"""An arm."""

class Arm:
    def torque(self, q):
        """Torque [N m]."""
        return -self.m * (g
            * sin(q))  # gravity

    def weight(self):
        return self.m * g
'''


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A project with one module; returns a function that writes another text of it, or another module."""
    monkeypatch.setattr(faults, "ROOT", tmp_path)
    monkeypatch.setattr(faults, "FAULTS", tmp_path / "faults.yaml")
    row = f"- in: {FAULT.place}\n  change: {FAULT.change}\n  to: {FAULT.to}\n  killed_by: test_torque\n"
    (tmp_path / "faults.yaml").write_text(f"# A heading stays\n{row}")
    (tmp_path / "src/myowave").mkdir(parents=True)

    def write(text, name="arm"):
        (tmp_path / f"src/myowave/{name}.py").write_text(text)
        faults._blocks_of.cache_clear()
        return tmp_path

    return write


@pytest.mark.parametrize("fault", faults.read_faults(), ids=str)
def test_a_fault_has_its_place_in_the_code_and_tests_that_know_it(fault):
    try:
        faults.with_fault(fault, faults.ROOT)
    except faults.LostError as error:
        new = faults.moved(fault)
        pytest.fail(f"{error}; {f'it is now {new.place}' if new else 'it is nowhere else'}. {faults.MEND}.")
    missing = [test for test in fault.killed_by if not faults.files_of(test, faults.ROOT)]
    assert not missing, f"no test is called {missing}: name the one that knows {fault}"


def test_a_fault_is_put_in_whatever_the_layout_and_comments_are(project):
    root = project(SOUND)
    for text in (SOUND, SOUND.replace("(g\n            * sin(q))  # gravity", "(g*sin(q))").replace("[N m]", "")):
        project(text)
        spoilt = faults.with_fault(FAULT, root)
        assert "-self.m * (g * q)" in spoilt and "self.m * g" in spoilt and "sin" not in spoilt


def test_statements_are_changed_too(project):
    root = project(SOUND)
    fault = replace(FAULT, change="return -self.m * (g * sin(q))", to="q = 0\nreturn q")
    assert "        q = 0\n        return q\n" in faults.with_fault(fault, root)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"place": "myowave.leg:Arm.torque"}, r"no src/myowave/leg\.py"),
        ({"place": "myowave.arm:Arm.pull"}, "0 of 'Arm.pull'"),
        ({"change": "g * cos(q)"}, "0 times"),
        ({"place": "myowave.arm:Arm", "change": "self.m"}, "2 times"),
    ],
    ids=str,
)
def test_a_fault_without_its_one_place_says_so(project, change, said):
    with pytest.raises(faults.LostError, match=said):
        faults.with_fault(replace(FAULT, **change), project(SOUND))


@pytest.mark.parametrize(
    ("text", "module", "place"),
    [
        (SOUND, "limb", "myowave.limb:Arm.torque"),
        (SOUND.replace("torque", "moment"), "arm", "myowave.arm:Arm.moment"),
        (SOUND.replace("sin(q)", "sin(angle)"), "limb", FAULT.place),
        (SOUND + SOUND.replace("Arm", "Leg").replace("torque", "moment"), "limb", "myowave.limb:Arm.torque"),
    ],
    ids=["moved", "renamed", "rewritten", "moved beside one alike"],
)
def test_a_row_follows_its_code(project, text, module, place):
    root = project(text, module)
    lost = faults.update()
    assert len(lost) == (place == FAULT.place)
    (row,) = faults.read_faults()
    assert row == replace(FAULT, place=place)
    assert (root / "faults.yaml").read_text().startswith("# A heading stays")


def test_rules_are_read_by_the_functions_in_them(project):
    root = project(SOUND)
    (root / "workflow").mkdir()
    (root / "workflow/data.smk").write_text(
        'def size(x):\n    return 2 * x\n\n\nrule make:\n    output:\n        "a",\n'
    )
    spoilt = faults.with_fault(replace(FAULT, place="workflow/data.smk:size", change="2 * x", to="x"), root)
    assert "return x\n" in spoilt and "rule make:\n    output:\n" in spoilt
