"""A diagnosis from Python, as the documentation shows it."""

import subprocess
import sys
import textwrap

import pytest
from project_copy import ROOT

import myowave

EXAMPLE = textwrap.dedent(myowave.__doc__.partition("\n\n")[2])


def test_the_six_lines_give_a_verdict_and_a_page(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("data", "config.yaml"):
        (tmp_path / name).symlink_to(ROOT / name)
    assert len(EXAMPLE.splitlines()) == 6
    found = {}
    exec(EXAMPLE, found)
    assert found["d"].verdict["verdict"] == "effect" and "joint_damping" in found["d"].verdict["effects"]
    page = (tmp_path / "bench_elbow.html").read_text()
    assert "joint_damping" in page and "data:image/png" in page
    assert "<pre></pre>" not in page and "Typed in the project" not in page, "no workflow made it: there is no command"
    assert found["d"].tables["parameters"]["model"].iloc[0] == "base"


def test_importing_the_package_loads_nothing_heavy():
    code = "import sys, myowave; print({'torch', 'pandas', 'numpy', 'mlflow', 'snakemake'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout == "set()\n"


@pytest.mark.parametrize(("arm", "says"), [("arm27", "no arm or file 'arm27'"), ({"muscles": {}}, "joint")])
def test_an_arm_that_is_not_there_is_named(arm, says, monkeypatch):
    monkeypatch.chdir(ROOT)
    with pytest.raises(ValueError, match=says):
        myowave.diagnose(None, arm)


def test_the_package_says_what_it_has():
    with pytest.raises(AttributeError, match="diagnose"):
        _ = myowave.diagnos
    assert myowave.Trials.__name__ == "Trials"
