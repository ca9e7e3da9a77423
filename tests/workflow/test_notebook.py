"""What Python users meet before anything is computed; tests/workflow/test_end_to_end.py runs the lines of the docs."""

import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from project_copy import ROOT

import myowave


def test_importing_the_package_loads_nothing_heavy():
    code = "import sys, myowave; print({'torch', 'pandas', 'numpy', 'mlflow', 'snakemake'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout == "set()\n"


@pytest.mark.parametrize(("arm", "says"), [("arm27", "no arm or file 'arm27'"), ({"muscles": {}}, "joint")])
def test_an_arm_that_is_not_there_is_named(arm, says, monkeypatch):
    monkeypatch.chdir(ROOT)
    with pytest.raises(ValueError, match=says):
        myowave.diagnose(None, arm)
    for config in ("gone.yaml", Path("gone.yaml"), ["gone.yaml"]):
        with pytest.raises(ValueError, match="There is no gone.yaml in .*, or name it with config=.$"):
            myowave.diagnose(None, config=config)


def test_mistakes_in_what_is_known_of_trials_are_told_as_those_of_a_file(monkeypatch):
    monkeypatch.chdir(ROOT)
    for name, hint in {"condition": "; did you mean 'conditions'", "identify": ". Known"}.items():
        with pytest.raises(ValueError, match=f"there is no '{name}'{hint}"):
            myowave.Trials.from_csv("data/bench_elbow/*.csv", test=["trial3"], **{name: {}})
    with pytest.raises(ValueError, match="^test = 'trial3': expected a list of texts"):
        myowave.Trials.from_csv("data/bench_elbow/*.csv", test="trial3")
    trials = myowave.Trials.from_csv("data/bench_elbow/*.csv", test=["trial3"], conditions={"trial1": {"laod": 1.0}})
    with pytest.raises(ValueError, match="there is no 'laod' in this arm; did you mean 'load'"):
        myowave.diagnose(trials)


def test_files_are_texts_or_paths_and_no_trials(monkeypatch):
    monkeypatch.chdir(ROOT)
    files = [Path(f"data/bench_elbow/trial{n}.csv") for n in (1, 2, 3)]
    assert myowave.Trials.from_csv(*files, test=["trial3"]).names == ("trial1", "trial2", "trial3")
    with pytest.raises(TypeError, match="trials = 'trial1.csv': expected what myowave.Trials.from_csv returns"):
        myowave.diagnose("trial1.csv")


def test_what_is_doubtful_in_trials_is_warned_of(tmp_path):
    for n in (1, 2, 3):
        frame = pd.read_csv(ROOT / f"data/bench_elbow/trial{n}.csv")
        (frame.assign(emg_biceps=0.1) if n == 2 else frame).to_csv(tmp_path / f"t{n}.csv", index=False)
    says = "^trial t2, emg_biceps: dead channel: scatters by .* typically by .*leave the trial or the channel out.$"
    with pytest.warns(UserWarning, match=says) as caught:
        trials = myowave.Trials.from_csv(f"{tmp_path}/*.csv", test=["t3"])
    assert trials.names == ("t1", "t2", "t3") and {one.filename for one in caught} == {__file__}


def test_the_package_says_what_it_has():
    with pytest.raises(AttributeError, match="diagnose"):
        _ = myowave.diagnos
    assert callable(myowave.Trials.from_csv)
