"""What changed between two groups of trials: the change is named with its size, and where there is none, none is."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from myowave.cli import app
from myowave.data.simulate import simulate_trials
from myowave.data.store import write_trials
from myowave.diagnosis.changed.ask import Family, _candidates, what_changed
from myowave.diagnosis.changed.by_trial import ByTrial, Differing, Directions, Point
from myowave.diagnosis.changed.weigh import evidence, likeliest
from myowave.diagnosis.changed.windows import Groups, Moving
from myowave.diagnosis.likelihood.algebra import Weighed
from myowave.diagnosis.report.change import change_page, changed_facts, tell_change
from myowave.identification.record import make_record
from myowave.physics.curves import MILLARD
from myowave.settings import Scatter, SimulatedDataset
from myowave.settings.data import Changed

SCATTER = {"shape": Scatter(absolute=0.15), "delay": Scatter(absolute=0.007)}
CANDIDATES = ("joint_damping", "hand_load", "gravity_tilt", "extra_delay")


@pytest.fixture(scope="module")
def ask(base, effects):
    """The question for six trials, of which nobody tells what differs in the third and fourth."""

    def asked(hidden, against, reference=("1", "2"), names=CANDIDATES, silent=(), workers=1, **more):
        conditions = {name: hidden for name in ("3", "4")}
        settings = SimulatedDataset(
            kind="simulated", trials=6, samples=300, test=("6",), seed=3, angle_noise_deg=0.2, conditions=conditions
        )
        trials = replace(simulate_trials("elbow", settings, base, {})[0], conditions={})
        lost = np.isin(trials.names, against)[:, None, None] & np.isin(trials.channels, silent)
        trials = replace(trials, emg=np.where(lost, 0.0, trials.emg))
        few = [effects[name] for name in names]
        groups = Changed(reference=reference, against=against, **{"electrodes_stayed": True, **more})
        return what_changed(trials, base, few, groups, SCATTER, workers=workers)

    return asked


@pytest.fixture(scope="module")
def loaded(ask):
    return ask({"load": 0.4}, ("3", "4"), workers=2)


def test_a_load_that_nobody_told_is_named_with_its_size(loaded):
    assert loaded.names == ("hand_load",)
    found = loaded.of("hand_load")
    assert found.value == pytest.approx(0.4, rel=0.25)
    assert found.interval[0] < 0.4 < found.interval[1]


def test_one_process_weighs_as_several_do(ask, loaded):
    alone, beside = (a.of("hand_load") for a in (ask({"load": 0.4}, ("3", "4"), names=("hand_load",)), loaded))
    assert alone.changed == pytest.approx(beside.changed, abs=1e-6) and alone.value == pytest.approx(beside.value)


def test_the_other_way_round_the_load_is_less(ask):
    found = ask({"load": 0.4}, ("1", "2"), reference=("3", "4"), names=("hand_load", "joint_damping"))
    assert found.names == ("hand_load",) and found.of("hand_load").interval[1] < 0


@pytest.mark.parametrize("rate_hz", [31.6, 47.0, 100.0])
def test_windows_that_count_as_samples_do_not_overlap(base, rate_hz):
    settings = SimulatedDataset(kind="simulated", trials=2, samples=150, test=("2",), seed=3, dt_s=1 / rate_hz)
    moving = Moving.along(base, make_record(simulate_trials("elbow", settings, base, {})[0], base), {})
    windows = moving.balance.windows
    apart = np.diff(moving.motion.time[: moving.motion.counts[0]])
    assert len(apart) > 2 and (apart > (2 * windows.half - 0.5) * windows.dt).all()


@pytest.fixture
def groups(base):
    """Two trials of each group in which nothing has changed."""
    settings = SimulatedDataset(kind="simulated", trials=4, samples=600, test=("4",), seed=3, angle_noise_deg=0.2)
    record = make_record(simulate_trials("elbow", settings, base, {})[0], base)
    return Groups(record, np.array([False, False, True, True]), base, SCATTER)


@pytest.mark.parametrize(
    ("parameter", "value", "wider"),
    [
        ("hand_load.m", 0.4, 1 / 1.4),  # beside 1 kg at 1 m, Eq. 55 of Taneja et al. 2023
        *(("constant_torque.tau", 5.0, 1.0), ("angle_scale.s", 0.25, 1.25), ("angle_offset.b", 0.1, 1.0)),
    ],
)
def test_motions_are_as_dense_as_the_arm_and_its_sensor_make_them(groups, effects, parameter, value, wider):
    """By how much wider what is reported spreads for the same torques."""
    seen = groups.windows(effects[parameter.split(".")[0]], [parameter], value * groups.second)
    denser = (seen.density - groups.plain.density) / seen.motion.counts
    np.testing.assert_allclose(denser, -np.log(wider) * groups.second, atol=1e-12)


def test_a_clock_that_is_late_is_a_drive_that_is_early(groups, effects):
    """And the same samples of the angle are compared, whenever they were reported."""
    late = np.array([0.0, 0.01, -0.02, 0.043])
    clock = groups.windows(effects["clock_shift"], ["clock_shift.d"], late)
    delay = groups.windows(effects["extra_delay"], ["extra_delay.d_emg_biceps", "extra_delay.d_emg_triceps"], late)
    np.testing.assert_allclose(clock.torque, groups.plain.torque, atol=0.1)  # of some 8 N m, by interpolation
    np.testing.assert_allclose(clock.usual, delay.usual, atol=0.1)
    assert np.abs(clock.usual - groups.plain.usual).max() > 1


@pytest.mark.parametrize("parameter", ["angle_scale.s", "hand_load.m"])
def test_what_a_trial_shows_hangs_on_its_own_value_alone(groups, effects, parameter):
    effect = effects[parameter.split(".")[0]]
    every, one = (groups.windows(effect, [parameter], 0.1 * trials) for trials in (np.ones(4), np.eye(4)[2]))
    mixed = groups.plain.but_one(every, 2)
    for name in ("torque", "usual", "activation", "density"):
        np.testing.assert_allclose(getattr(mixed, name), getattr(one, name), rtol=1e-9, err_msg=name)
    np.testing.assert_allclose(mixed.motion.mean, one.motion.mean, rtol=1e-9)


@pytest.mark.parametrize(("name", "value"), [("angle_scale", 0.1), ("hand_load", 0.1), ("constant_torque", 1.0)])
def test_a_search_climbs_as_the_likelihood_does(groups, effects, name, value):
    (parameter, *_) = effects[name].parameters
    nothing = Point(np.zeros(4), groups.plain, likeliest(groups.plain, {}))

    def windows(values):
        return groups.windows(effects[name], (f"{name}.{parameter}",), value * values)

    by_trial = ByTrial(windows, -10.0, 10.0, nothing)
    _, slope = by_trial._normal(nothing, np.eye(4))
    ahead, behind = (
        [evidence(windows(step * trial), nothing.state.sizes) for trial in np.eye(4)] for step in (0.02, -0.02)
    )
    np.testing.assert_allclose(slope, np.subtract(ahead, behind) / 0.04, rtol=0.02, atol=0.02)


@pytest.mark.parametrize("seed", [3, 4])
def test_a_load_is_named_though_the_muscles_have_curves_of_another_family(base, effects, seed):
    conditions = {name: {"load": 0.4} for name in ("3", "4")}
    settings = SimulatedDataset(
        kind="simulated", trials=5, samples=600, test=("5",), seed=seed, angle_noise_deg=0.3, conditions=conditions
    )
    trials = simulate_trials("elbow", settings, replace(base, curves=MILLARD), {})[0]
    groups = Changed(reference=("1", "2"), against=("3", "4"), electrodes_stayed=True)
    asked = [effects[name] for name in ("hand_load", "constant_torque", "gravity_tilt")]
    found = what_changed(replace(trials, conditions={}), base, asked, groups, SCATTER)
    assert found.names == ("hand_load",) and found.of("hand_load").value == pytest.approx(0.4, rel=0.25)


@pytest.mark.parametrize(("low", "sign", "last"), [(-5.0, -1.0, -1.0), (-0.5, -1.0, -0.25), (-5.0, 1.0, 0.0)])
def test_first_values_are_tried_within_bounds_while_each_is_likelier(monkeypatch, low, sign, last):
    second = np.array([0.0, 1.0])

    def point(self, values, near):
        return Point(values, None, Weighed({}, -((values[1] + 1.2) ** 2)))

    monkeypatch.setattr(ByTrial, "_point", point)
    by_trial = ByTrial(None, low, 5.0, point(None, 0 * second, None))
    assert by_trial._rise(sign * second).values == pytest.approx(last * second)


def test_errors_of_constants_are_shares_and_of_single_muscles_as_in_a_fit(base):
    trials = simulate_trials("elbow", SimulatedDataset(kind="simulated", trials=3, samples=300, test=("3",)), base, {})[
        0
    ]
    groups = Groups(make_record(trials, base), np.array([False, True, True]), base, {})
    usual = base.muscles[0].nominal["delay"]
    assert usual == base.muscles[1].nominal["delay"]
    same = [
        {"delay": Scatter(absolute=0.1 * usual)},
        {"delay": Scatter(relative=0.1)},
        {"delay_Bi": Scatter(relative=0.1), "delay_Tri": Scatter(absolute=0.1 * usual)},
    ]
    one, *others = (replace(groups, scatter=scatter).by_errors for scatter in same)
    assert np.abs(one).max() > 0.01
    for other in others:
        np.testing.assert_allclose(other, one, rtol=1e-12)


def test_a_lean_is_no_load(ask):
    found = ask({"tilt": 0.3}, ("3", "4"), names=("hand_load", "gravity_tilt"))
    assert found.names == ("gravity_tilt",) and found.of("gravity_tilt").value == pytest.approx(0.3, abs=0.1)


def test_nothing_is_found_where_nothing_changed_nor_in_the_control(loaded, ask):
    same = ask({"load": 0.4}, ("5",))
    assert same.names == () and same.arm.unchanged > 0.5 and same.verdict == "adequate"
    facts = changed_facts("elbow", same)
    told = tell_change(facts)
    assert (
        "Most likely nothing that was weighed has changed" in told[0]
        and "within their 95 % intervals, which the page lists, are not excluded" in told[1]
    )
    unsure = " ".join(tell_change({**facts, "verdict": "undecidable", "unchanged": 0.16}))
    assert "It is not sure that anything changed" in unsure and "with probability 0.16 nothing has." in unsure
    assert "it is most likely" in unsure and "Nothing" not in unsure, "what may have changed is not said to be the same"
    assert loaded.control is not None and loaded.control.names == ()


@pytest.mark.parametrize(
    ("unchanged", "verdict"), [(0.9, "adequate"), (0.3, "undecidable"), (0.051, "undecidable"), (0.049, "effect")]
)
def test_what_may_have_changed_is_neither_named_nor_denied(loaded, unchanged, verdict):
    (likeliest, *_) = loaded.arm.changes
    family = Family((replace(likeliest, probability=1 - unchanged),), unchanged)
    found = replace(loaded, arm=family)
    assert family.verdict == verdict == found.verdict and changed_facts("elbow", found)["verdict"] == verdict
    assert replace(found, electrodes=Family((), 1.0)).verdict == verdict, "one of two families is enough to be unsure"


@pytest.mark.parametrize(
    ("arm", "electrodes", "names"),
    [
        (0.01, 0.9, ("hand_load",)),
        (0.01, 0.3, ("hand_load", "emg_gain")),
        (0.01, 0.01, ("hand_load", "emg_gain")),
        (0.3, 0.01, ("hand_load", "emg_gain")),
        (0.9, 0.01, ("emg_gain",)),
        (0.3, 0.3, ()),
    ],
)
def test_what_electrodes_may_report_anew_is_not_ruled_out_by_a_name(loaded, arm, electrodes, names):
    (change, *_) = loaded.arm.changes
    families = [
        Family((replace(change, effect=name, probability=1 - unchanged),), unchanged)
        for name, unchanged in (("hand_load", arm), ("emg_gain", electrodes))
    ]
    assert replace(loaded, arm=families[0], electrodes=families[1]).names == names


@pytest.mark.parametrize(("information", "likeliest"), [(1.0, 3.0), (0.05, 8.0)])
def test_what_is_usual_counts_once(monkeypatch, information, likeliest):
    """Of trials whose likelihoods are exactly Gaussian about 0 and, in the second group, about `likeliest`."""
    second = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])

    def point(self, values, near):
        return Point(values, None, Weighed({}, -0.5 * information * ((values - likeliest * second) ** 2).sum()))

    def normal(self, point, columns):
        return information * columns.T @ columns, information * columns.T @ (likeliest * second - point.values)

    monkeypatch.setattr(ByTrial, "_point", point)
    monkeypatch.setattr(ByTrial, "_normal", normal)
    nothing = point(None, 0 * second, None)
    found = ByTrial(None, -100.0, 100.0, nothing).differing(second, np.zeros((6, 0)))
    every = Directions.of(np.eye(6), second, np.zeros((6, 0)))
    exact = Differing(every, every.columns.T @ (likeliest * second), np.eye(5) / information, -nothing.state.value)
    assert found.change == pytest.approx(exact.change, abs=0.06)
    assert (found.changed, found.anyway) == pytest.approx((exact.changed, exact.anyway), abs=0.03)


def test_no_value_is_taken_for_likelier_beyond_its_bounds(monkeypatch):
    """Of trials whose likelihoods are exactly Gaussian, in the second group about more than is possible."""
    second = np.array([0.0, 0.0, 1.0, 1.0])

    def point(self, values, near):
        inside = values.clip(-5.0, 5.0)
        return Point(inside, None, Weighed({}, -0.5 * ((inside - 8.0 * second) ** 2).sum()))

    def normal(self, point, columns):
        return columns.T @ columns, columns.T @ (8.0 * second - point.values)

    monkeypatch.setattr(ByTrial, "_point", point)
    monkeypatch.setattr(ByTrial, "_normal", normal)
    nothing = point(None, 0 * second, None)
    found = ByTrial(None, -5.0, 5.0, nothing).differing(second, np.zeros((4, 0)))
    assert found.values == pytest.approx(5.0 * second) and found.nats == pytest.approx(64.0 - 9.0)


def test_electrodes_placed_anew_may_be_what_changed(ask):
    names = ("hand_load", "emg_gain")
    found = ask({"load": 0.4}, ("3", "4"), names=names, electrodes_stayed=False)
    assert "emg_gain" in found.names and "hand_load" in found.names
    assert "emg_gain" not in ask({"load": 0.4}, ("3", "4"), names=names).names


@pytest.mark.parametrize("channel", ["emg_biceps", "emg_triceps"])
def test_an_electrode_that_reports_nothing_is_what_changed_and_no_load(ask, channel):
    found = ask({}, ("3", "4"), names=("hand_load", "gravity_tilt"), silent=(channel,))
    assert found.names == ("silent_electrode",) and found.of("silent_electrode").electrode == channel
    facts = changed_facts("elbow", found)
    assert channel in tell_change(facts)[0] and json.dumps(facts, allow_nan=False)
    assert "-inf" not in change_page(facts) and "(95 %" not in tell_change(facts)[1]
    both = tell_change({**facts, "class": ["silent_electrode", "hand_load"]})
    assert f"{channel} (-1.0), and a load in the hand that nobody noted." in both[0]


def test_without_any_electrode_there_is_nothing_to_ask(ask):
    with pytest.raises(ValueError, match="found no EMG in one of the groups"):
        ask({}, ("3", "4"), silent=("emg_biceps", "emg_triceps"))


def test_of_a_machine_it_is_said_what_to_do_instead(base, clean):
    groups = Changed(reference=("1", "2"), against=("3", "4"))
    with pytest.raises(ValueError, match="an arm without muscles: .* each group as a dataset of its own"):
        what_changed(clean, replace(base, muscles=()), [], groups, {})


def test_effects_with_states_and_sensors_that_report_slow_motions_otherwise_are_said_to_be_left_out(ask):
    names = ("hand_load", "fatigue", "vmax_change", "observation_lag", "elastic_mount", "clock_drift", "angle_scale")
    answer = ask({"load": 0.4}, ("3",), names=names)
    page = change_page(changed_facts("elbow", answer))
    expected = "muscle fatigue, another maximum shortening velocity, an angle sensor that lags, a flexible mount of the"
    assert f"Not weighed: {expected} angle sensor, a time drift between EMG and motion." in page


def test_no_change_is_sought_in_what_does_nothing_alone(base, effects):
    effect = effects["stribeck_friction"]
    sought = _candidates(base.with_effects([effect]), effect)
    assert [change.parameters for change in sought] == [("stribeck_friction.tau",)] and len(effect.parameters) == 2


def test_the_first_sentence_tells_what_how_much_and_what_the_control_says(loaded):
    facts = changed_facts("elbow", loaded)
    told = tell_change(facts)
    assert "a load in the hand that nobody noted" in told[0] and "kg" in told[0]
    assert "Control: the same question within the first group, 1 against 2" in told[-2]
    assert facts["class"] == ["hand_load"] and facts["changes"][0]["low"] < 0.4 < facts["changes"][0]["high"]
    assert "First group: trials 1, 2. Second: 3, 4." in told


@pytest.mark.parametrize(
    ("control", "expected"),
    [
        (None, "There is no control"),
        ({"verdict": "adequate", "class": [], "unchanged": 0.8}, "It finds no change there, as it should."),
        (
            {"verdict": "undecidable", "class": [], "unchanged": 0.16},
            "but is not sure of that: the probability that nothing changed there",
        ),
        (
            {"verdict": "effect", "class": ["joint_damping"], "unchanged": 0.01},
            "It names damping of the joint there: do not believe",
        ),
    ],
)
def test_the_control_says_whether_to_believe_a_name(loaded, control, expected):
    told = tell_change({**changed_facts("elbow", loaded), "control": control})
    assert expected in " ".join(told), told


def test_the_command_asks_of_the_groups_it_is_given_with_what_is_known_of_the_dataset(
    make_trials, pytestconfig, tmp_path, monkeypatch
):
    asked = []

    def ask(trials, base, effects, groups, scatter, *_, **__):
        asked.append((groups, scatter))
        raise ValueError("that is all")

    monkeypatch.setattr("myowave.diagnosis.changed.ask.what_changed", ask)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data").symlink_to(pytestconfig.rootpath / "data")
    write_trials(make_trials(), "results/data/elbow/trials.parquet")
    changed = {"reference": ["1"], "against": ["2"], "electrodes_stayed": True}
    block = {"kind": "simulated", "trials": 4, "test": ["4"], "scatter": {"shape": {"absolute": 0.05}}}
    config = yaml.safe_load((pytestconfig.rootpath / "config.yaml").read_text(encoding="utf-8"))
    config["data"]["datasets"]["elbow"] = {**block, "changed": changed}
    Path("config.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")
    others = ["--reference", "2", "--against", "1, 3"]
    for options, groups in (
        ([], Changed(**changed)),
        (others, Changed(reference=["2"], against=["1", "3"])),
        (["--reference", "3"], Changed(reference=["3"], against=["2"])),
        (["--against", "3,4"], Changed(reference=["1"], against=["3", "4"])),
        ([*others, "--electrodes-stayed"], Changed(reference=["2"], against=["1", "3"], electrodes_stayed=True)),
    ):
        done = CliRunner().invoke(app, ["changed", "elbow", *options])
        found, scatter = asked.pop()
        assert done.exit_code == 2 and found == groups
        assert scatter["shape"].absolute == 0.05 and scatter["vmax"].relative == 0.2
    config["data"]["datasets"]["elbow"]["conditions"] = {"2": {"load": 1.0}}
    Path("config.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")
    done = CliRunner().invoke(app, ["changed", "elbow"])
    assert done.exit_code == 2 and "prepared with other conditions.2 than" in done.stderr and not asked
    del config["data"]["datasets"]["elbow"]["changed"]
    Path("config.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")
    done = CliRunner().invoke(app, ["changed", "elbow", "--reference", "3"])
    assert done.exit_code == 2 and "data.datasets.elbow.changed.against" in done.stderr and not asked
