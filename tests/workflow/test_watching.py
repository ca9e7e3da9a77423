"""`myowave plan --watch`: trials are read as they appear, and what they leave open comes next."""

import shutil
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
import yaml
from project_copy import ROOT
from typer.testing import CliRunner

from myowave import watching
from myowave.cli import app

BENCH = ROOT / "data/bench_elbow"


@pytest.fixture
def session(tmp_path, monkeypatch):
    """Watch an empty folder; each step is done before one look at it, and then somebody presses Ctrl-C."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(ROOT / "config.yaml", tmp_path)
    (tmp_path / "data").symlink_to(ROOT / "data")
    (tmp_path / "new").mkdir()

    def run(*steps, dataset="bench_elbow", options=()):
        left = list(steps)

        def wait(_):
            if not left:
                raise KeyboardInterrupt
            left.pop(0)()

        monkeypatch.setattr(watching.time, "sleep", wait)
        return CliRunner().invoke(app, ["plan", "--dataset", dataset, "--watch", "new", *options])

    return run


def put(name, part=1.0, source="trial1.csv"):
    """Write a trial, or the first part of it."""

    def write():
        text = (BENCH / source).read_text()
        Path(f"new/{name}.csv").write_text(text[: int(part * len(text))])

    return write


def look():
    """Nothing happens."""


def test_a_trial_is_read_once_it_is_whole_and_the_next_one_is_asked_for(session):
    done = session(put("a", 0.3), put("a", 0.6), put("a"), look, look, put("b", source="trial2.csv"), look)
    said = done.stdout
    assert done.exit_code == 0 and not done.stderr
    assert "0 trials are in new" in said and "left out" not in said, "half a file is waited for"
    first, second = said.index("\n1 trials: a"), said.index("\n2 trials: a, b")
    assert "Next: the same once more. It decides: Do EMG and muscles foretell" in said[first:second]
    assert "decided: Strength of the biceps? " in said[second:] and "EMG and muscles, " in said[second:]
    assert said.count(" trials: a, b") == 1, "nothing is said where nothing is new"


def test_a_file_counts_by_its_ending_however_that_is_written(session):
    done = session(put("a"), lambda: Path("new/a.csv").rename("new/a.CSV"), look)
    assert done.exit_code == 0 and "\n1 trials: a" in done.stdout


def test_a_bad_trial_is_left_out_until_it_changes(session):
    def spoil():
        Path("new/b.csv").write_text("time_s,emg_biceps\n0,1\n")

    done = session(put("a"), look, spoil, look, look, put("b", source="trial2.csv"), look)
    said = done.stdout
    assert done.exit_code == 0 and said.count("b is left out until its files or the settings change: ") == 1
    assert "new/b.csv" in said
    assert said.index("left out") < said.index("2 trials: a, b")


def spoilt(change, source="trial2.csv"):
    """Write trial b with a fault."""
    return lambda: change(pd.read_csv(BENCH / source)).to_csv("new/b.csv", index=False)


def test_a_trial_that_lacks_a_muscle_of_the_arm_is_left_out_by_its_name(session):
    done = session(put("a"), look, spoilt(lambda f: f.drop(columns="emg_triceps")), look, put("c", source="trial3.csv"),
                   look)  # fmt: skip
    assert done.exit_code == 0 and "new/b.csv: column 'emg_triceps' is not there" in done.stdout
    assert "2 trials: a, c" in done.stdout


def test_what_is_doubtful_of_a_trial_is_told_once(session):
    def off(frame):
        return frame.assign(emg_biceps=0.1)

    done = session(put("a"), spoilt(off), look, put("c", source="trial3.csv"), look, spoilt(off, "trial4.csv"), look)
    said = done.stdout
    line = "  doubtful: trial b, emg_biceps: dead channel: scatters by 0 au"
    assert done.exit_code == 0 and said.count(line) == 2, said
    assert said.index("2 trials: a, b") < said.index(line) < said.index("3 trials: a, b, c") < said.rindex(line)
    assert "leave the trial or the channel out" in said and "doubtful: trial a" not in said


@pytest.mark.parametrize(("broken", "says"), [("data: [", "mine.yaml is not valid YAML"), ("trget: 1", "did you mean")])
def test_settings_that_are_not_right_leave_those_before(session, broken, says):
    def write(text):
        return lambda: Path("mine.yaml").write_text(text)

    write("{}")()
    steps = (put("a"), look, write(broken), put("b", source="trial2.csv"), look, write("{}  "), look)
    done = session(*steps, options=["--config", "config.yaml", "--config", "mine.yaml"])
    said = done.stdout
    assert done.exit_code == 0 and said.count("The settings stay what they were until this is right: ") == 2, said
    assert says in said and said.count("\n2 trials: a, b\n") == 2
    assert said.rindex("stay what they were") < said.rindex("2 trials: a, b")


def test_what_cannot_be_asked_ends_no_session(session, monkeypatch):
    def ask(trials, settings, dataset):
        raise ValueError("so many samples")

    monkeypatch.setattr(watching, "ask", ask)
    done = session(put("a"), look, put("b", source="trial2.csv"), look)
    assert done.exit_code == 0 and done.stdout.count("Nothing can be asked of these: so many samples") == 2


def test_all_trials_are_read_at_once_and_one_by_one_only_where_that_fails(session, monkeypatch):
    read, of_names = [], watching.import_named

    def import_named(names, *others):
        read.append(tuple(names))
        return of_names(names, *others)

    monkeypatch.setattr(watching, "import_named", import_named)
    monkeypatch.setattr(watching, "ask", lambda *_: [])

    def change():
        Path("config.yaml").write_text(Path("config.yaml").read_text() + "\n")

    put("a")(), put("c", source="trial3.csv")()
    good, bad = spoilt(lambda frame: frame), spoilt(lambda frame: frame[:5])
    session(look, change, look, bad, look, change, look, good, look)
    found = [read[0], read[1], read[2], *map(set, read[3:7]), read[7]]
    assert found == [("a", "c"), ("a", "c"), ("a", "c", "b"), {"a", "b", "c"}, {"a"}, {"a", "c"}, {"a", "b", "c"},
                     ("a", "c", "b")]  # fmt: skip


@pytest.mark.parametrize(("first", "second"), [("a", "b"), ("b", "a")])
def test_trials_keep_the_order_in_which_they_appeared_where_the_settings_are_newer(session, first, second):
    def change():
        Path("config.yaml").write_text(Path("config.yaml").read_text() + "\n")

    said = session(put(first), put(second, source="trial2.csv"), look, change, look).stdout
    assert said.count(f"\n2 trials: {first}, {second}\n") == 2


def test_what_the_hand_holds_is_told_by_the_settings_or_by_the_name(session):
    config = yaml.safe_load(Path("config.yaml").read_text())
    conditions = config["data"]["datasets"]["bench_elbow"].setdefault("conditions", {})
    conditions["trial1"] = {"load": 0.0}
    Path("mine.yaml").write_text(yaml.safe_dump({"data": config["data"]}))

    def correct():
        conditions["b"] = {"load": 1.0}
        Path("mine.yaml").write_text(yaml.safe_dump({"data": config["data"]}))

    steps = (put("trial7"), put("b", source="trial4.csv"), put("1.5kg_1", source="trial2.csv"), look, correct, look)
    said = session(*steps, options=["--config", "config.yaml", "--config", "mine.yaml"]).stdout
    assert "b is left out" in said and "Call it 2kg_1, or write conditions: {b: {load: 2}}" in said
    assert "2 trials: trial7, 1.5kg_1" in said and "3 trials" in said, said


def test_trials_of_a_kind_that_hold_unlike_loads_say_nothing_of_the_next():
    block = SimpleNamespace(conditions={"trial1": {"load": 1.0}, "trial2": {"load": 2.0}, "light_1": {"load": 0.5}})
    known = {name: watching._known_of(name, block) for name in ("trial2", "light_7", "3kg_1")}
    assert known == {"trial2": {"load": 2.0}, "light_7": {"load": 0.5}, "3kg_1": {"load": 3.0}}
    with pytest.raises(ValueError, match="what does the hand hold?"):
        watching._known_of("trial3", block)


def test_a_load_in_a_name_has_either_decimal_sign_and_is_asked_for_where_it_may_be_another():
    block = SimpleNamespace(conditions={})
    named = {"2,5kg_1": 2.5, "0,5 kg a": 0.5, "1.5KG_1": 1.5, "curl1_2kg": 2.0, "curl12-5Kg_1": 5.0, "slow_2kg": 2.0}
    for name, load in named.items():
        assert watching._known_of(name, block) == {"load": load}, name
    for name in ("2_5kg_1", "2-5kg_1", "curl_12_5 kg", "slow-2_5KG"):
        with pytest.raises(ValueError, match=f"Call it 2kg_1, or write conditions: {{{name}: {{load: 2}}}}"):
            watching._known_of(name, block)
    told = SimpleNamespace(conditions={"2_5kg_1": {"load": 2.5}})
    assert watching._known_of("2_5kg_1", told) == watching._known_of("2_5kg_2", told) == {"load": 2.5}


def test_raw_trials_are_found_by_the_patterns_of_the_settings_and_groups_by_their_names(session):
    block = yaml.safe_load(Path("config.yaml").read_text())["data"]["datasets"]["human_curls"]
    block = yaml.safe_load(yaml.safe_dump(block).replace("data/elbow_curls", "new"))
    block["changed"] = {"reference": ["load2.75_1"], "against": ["load5.5_1"]}
    Path("mine.yaml").write_text(yaml.safe_dump({"data": {"datasets": {"human_curls": block}}}))

    def record():
        for part in ("emg", "motion"):
            for trial in ("load2.75_2", "load5.5_3"):
                shutil.copytree(ROOT / f"data/elbow_curls/{part}/{trial}", f"new/{part}/{trial}")

    options = ["--config", "config.yaml", "--config", "mine.yaml"]
    said = session(record, look, dataset="human_curls", options=options).stdout
    assert "2 trials: load" in said and "Strength of flexors?" in said
    assert "open: What changed between the two groups? 1 trials of the first, 1 of the second." in said


def test_groups_whose_names_differ_by_a_number_only_are_those_that_are_listed(session, monkeypatch):
    asked, config = [], yaml.safe_load(Path("config.yaml").read_text())

    def ask(trials, base, effects, groups, *_, **__):
        asked.append((groups.reference, groups.against))
        return SimpleNamespace(names=(), control=None)

    monkeypatch.setattr(watching, "what_changed", ask)
    monkeypatch.setattr(watching, "changed_facts", lambda *_: {})
    monkeypatch.setattr(watching, "tell_change", lambda _: ["Nothing."])
    groups = {"reference": ["trial1", "trial2"], "against": ["trial4", "trial5"]}
    config["data"]["datasets"]["bench_elbow"]["changed"] = groups
    Path("mine.yaml").write_text(yaml.safe_dump({"data": config["data"]}))
    names = ["trial1", "trial2", "trial3", "trial4", "trial5"]
    puts = [put(name, source=f"{name}.csv") for name in names]
    done = session(*puts, look, options=["--config", "config.yaml", "--config", "mine.yaml"])
    assert "5 trials: " in done.stdout, done.output
    assert asked[-1] == (("trial1", "trial2"), ("trial4", "trial5"))
    assert "and name it under changed" in done.stdout


@pytest.mark.parametrize(
    ("dataset", "folder", "says"),
    [
        ("bench_elbow", "gone", "gone: no such folder"),
        ("case1", ".", "case1 is simulated"),
    ],
)
def test_what_cannot_be_watched_is_said(session, dataset, folder, says):
    done = CliRunner().invoke(app, ["plan", "--dataset", dataset, "--watch", folder])
    assert done.exit_code == 2 and says in done.stderr


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"verdict": 1}', '{"torque": {"r2": 1', "\0"])
def test_a_verdict_that_is_none_is_named(session, content):
    path = Path("results/diagnosis/me/verdict.json")
    path.parent.mkdir(parents=True)
    path.write_text(content)
    done = CliRunner().invoke(app, ["plan", "--dataset", "me"])
    assert done.exit_code == 2 and f"{path} is no verdict" in done.stderr and "made anew" in done.stderr
    assert done.stderr.count("emove it") == 1
