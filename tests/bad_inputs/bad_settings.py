"""Settings that are wrong: one key of the configuration that ships, or of a session of raw recordings."""

import copy
from pathlib import Path

import yaml

from myowave.settings import parse_settings
from studies.held_out.settings import HeldOut
from studies.shared import read_section

ROOT = Path(__file__).parents[2]
SHIPPED = yaml.safe_load((ROOT / "config.yaml").read_text())


def changed(path: str, value: object) -> dict:
    """The configuration that ships with one key set."""
    config = copy.deepcopy(SHIPPED)
    *parents, last = path.split(".")
    section = config
    for part in parents:
        section = section.setdefault(part, {})
    section[last] = value
    return config


def of_value(path: str, value: object) -> str:
    """What the configuration with another value is answered by."""
    parse_settings(changed(path, value))
    return ""


def of_session(**changes) -> str:
    """The same of a block of raw recordings."""
    signal = {"file": "{trial}.csv", "format": "noraxon"}
    block = {
        "kind": "recorded", "trials": ["a", "b", "c"], "test": ["c"], "angle": dict(signal), "arm": "paper",
        "emg": {f"emg_{m}": dict(signal) for m in ("biceps", "triceps")},
        "signals": {"tilt_rad": {**signal, "condition": "tilt"}},
    }  # fmt: skip
    return of_value("data.datasets.human_curls", {**block, **changes})


def split(**roles) -> dict:
    return {"like_the_others": {"one": roles}}


def of_study(**changes) -> str:
    """The same of the settings of a study."""
    section = yaml.safe_load((ROOT / "studies/held_out/settings.yaml").read_text())["held_out"]
    read_section(HeldOut, "held_out", {**section, **changes}, parse_settings(SHIPPED))
    return ""


ALL = [f"load{kg}_{n}" for kg in ("2.75", "5.5") for n in (1, 2, 3)]
SWEEP = {"dataset": "case1", "recipe": "rollout", "scales": 2, "dimensions": {"hidden": {"low": 4, "high": 64}}}
BAR = {"mass_kg": 1.0, "length_m": 0.3}
VALUES = [
    ("learning.recipes.rollout.hidden", -5, ("-5", "whole number", "at least 1")),
    ("learning.recipes.rollout.learning_rate", "fast", ("'fast'", "a number", "above 0")),
    (
        "physics.arms.arm26_brd",
        {"muscles": {}, "joint": BAR},
        (
            "no muscle of arm arm26_brd is driven by",
            "null",
            "targets.datasets: the arm of human_curls has no",
            "learning.sweep.dataset: the arm of human_curls has no",
        ),
    ),
    ("physics.arms.paper", {"muscles": {}, "joint": BAR}, ("data.datasets.case1.arm: paper has no muscles", "another")),
    ("physics.arms.paper.muscles.Bi.side", "top", ("'top'", "flexor or extensor")),
    ("physics.arms.paper.muscles.Bi.f0_N", 0, ("0", "above 0", "[N]", "isometric")),
    ("physics.arms.paper.joint.mass_kg", True, ("True", "number")),
    ("physics.arms.paper.joint.mass_kg", float("nan"), ("nan", "number")),
    ("data.datasets.case1.samples", 3.5, ("3.5", "whole number")),
    ("data.datasets.case1.kind", "simulatd", ("'simulatd'", "measured or recorded or simulated")),
    ("data.datasets.bench_elbow.files", "trial1.csv", ("'trial1.csv'", "a list of")),
    ("physics.arms.paper.joint", {"mass_kg": 1, 4: None}, ("joint.4 = 4", "decimals need a point")),  # {mass_kg: 1,4}
    (
        "data.datasets",
        {"a/b": {"kind": "simulated"}},
        r"a/b.\[key\] = 'a/b': expected letters, digits and _, a letter first\n",
    ),
    ("data.datasets.case1.arm", "my arm", ("arm = 'my arm': expected letters, digits and _, a letter first",)),
    ("diagnosis.scatter", {"2-sided": {}}, r"= '2-sided': expected letters, digits and _, a letter first$"),
    ("learning.baselines", {4: {"kind": "hold"}}, ("baselines.4", "a name is text")),
    ("targets.scales", [1, 9], ("9", "1 to 5")),
    ("targets.datasets", ["case7"], ("'case7'", "case1", "bench_elbow")),
    ("targets.without_networks", ["case7"], ("'case7'", "case1", "bench_elbow")),
    ("targets", {"datasets": []}, ("datasets", "without_networks", "both are empty")),
    ("targets.models", {"case1": ["joint_damping"]}, ("'joint_damping'", "base+joint_damping")),
    ("data.datasets.case1.test", ["7"], ("7", "1, 2, 3, 4, 5")),
    ("data.datasets.case1.identify", {"f0_Bic": {}}, ("f0_Bic", "did you mean 'f0_Bi'")),
    ("data.datasets.case1.identify", {"f0_Bi": {"low": 3, "high": 2}}, ("low", "below high")),
    ("data.wavelet.levels", 1, ("targets.scales", "data.wavelet.levels")),
    ("learning.recipes.rollout.epochs", 2, ("rollout.epochs = 2", "at least 3", "targets.scales", "fewer scales")),
    ("learning.sweep", {**SWEEP, "epochs": 1}, ("sweep.epochs = 1", "at least 2", "learning.sweep.scales")),
    ("learning.sweep", {**SWEEP, "dimensions": {"epochs": {"low": 1, "high": 9}}}, ("epochs.low = 1", "at least 2")),
    # values that no arm has
    ("data.datasets.bench_elbow.constants", {"mass": -1}, ("constants.mass = -1", "above 0", "[kg]")),
    ("data.datasets.bench_elbow.constants", {"length": 0}, ("constants.length = 0", "at least 0.001", "[m]")),
    ("data.datasets.bench_elbow.constants", {"vmax_Bi": -3}, ("vmax_Bi = -3", "above 0", "[m/s]")),
    ("data.datasets.bench_elbow.constants", {"mass": float("nan")}, ("constants.mass = nan", "number")),
    ("data.datasets.bench_elbow.conditions", {"trial1": {"load": -50}}, ("trial1.load = -50", "at least 0")),
    ("data.datasets.bench_elbow.conditions", {"trial1": {"tilt": 30}}, ("tilt = 30", "at most 3.1", "[rad]")),
    ("data.datasets.case1.identify", {"f0_Bi": {"low": -500, "high": -100}}, ("f0_Bi.low = -500", "above 0")),
    ("data.datasets.case1.identify", {"l0_Bi": {"low": 50, "high": 300}}, ("l0_Bi.low = 50", "at most 5 [m]")),
    ("data.datasets.case1.identify", {"f0_Bi": {"literature": [-3]}}, ("literature", "positive")),
    ("data.datasets.case1.identify", {"pennation_Bi": {}}, ("identify.pennation_Bi", "is 0", "nothing to start")),
    ("physics.arms.paper.muscles.Bi.l0_m", 116, ("116", "at most 5 [m]", "optimal fibre length")),
    ("physics.arms.paper.joint.length_m", 250, ("250", "at most 5 [m]")),
    # names that nothing has, or that something else would read otherwise
    ("data.datasets.bench_elbow.constants", {"joint_damping.c": 1.5}, ("no 'joint_damping.c'", "effect")),
    ("data.datasets.bench_elbow.constants", {"foo.bar": 1}, ("no 'foo.bar'", "Known: ", "f0_Bi")),
    ("data.datasets.bench_elbow.constants", {"com": 0.2}, ("constants.com: there is no 'com' in arm paper", "length")),
    ("data.datasets.bench_elbow.conditions", {"trial1": {"com": 0.2}}, ("trial1.com: there is no 'com' in arm paper",)),
    ("data.datasets.bench_elbow.conditions", {"trial1": {"foo.bar": 1}}, ("trial1.foo.bar", "no 'foo.bar'")),
    ("data.datasets.bench_elbow.identify", {"foo.bar": {}}, ("identify.foo.bar", "no 'foo.bar'")),
    ("data.datasets.bench_elbow.test", ["tri$al3$"], ("'tri$al3$'", "$", "rename")),
    ("data.datasets.bench_elbow.files", ["data/{me}/*.csv"], ("'data/{me}/*.csv'", "braces", "rename")),
    ("data.datasets.human_curls.signals.tilt_rad.condition", "mass", ("mass is in kg", "an angle", "tilt")),
    # the same twice
    ("targets.datasets", ["case1", "case1"], ("targets.datasets", "case1 is there more than once")),
    ("targets.without_networks", ["human_curls"] * 2, ("human_curls is there more than once",)),
    ("targets.recipes", ["rollout", "rollout"], ("targets.recipes", "rollout is there more than once")),
    ("targets.own_recipes", {"case7": ["rollout"]}, ("targets.own_recipes", "no 'case7'")),
    ("targets.own_recipes", {"case1": ["rollot"]}, ("own_recipes.case1", "did you mean 'rollout'?")),
    ("targets.own_recipes", {"case1": []}, ("own_recipes.case1 = []", "list of texts")),
    ("learning.recipes.rollout.optimiser", "kept", ("'kept'", "adam or soap")),
    ("targets.scales", [1, 1, 2], ("targets.scales", "1 is there more than once")),
    ("targets.models", {"case1": ["base", "base"]}, ("targets.models", "base is there more than once")),
    ("targets.models", {"case1": ["base+fatigue+fatigue"]}, ("fatigue is there more than once",)),
    ("data.datasets.case1.test", ["3", "3"], ("case1.test", "3 is there more than once")),
    ("data.datasets.case1.conditions", {"1": {"f0_Bi": 200}}, ("f0_Bi is both known (conditions)", "keep one")),
    # values that cannot run, or never end
    ("learning.recipes.rollout.epochs", 10**18, ("epochs", "at most 1e+06")),
    ("learning.recipes.rollout.patience", 10**12, ("patience", "at most 1e+06")),
    ("learning.recipes.rollout.simulated_trials", 10**9, ("simulated_trials", "at most 10000")),
    ("learning.recipes.rollout.simulated_trials", -1, ("simulated_trials", "at least 0")),
    ("learning.recipes.rollout.hidden", 10**6, ("hidden", "at most 4096")),
    ("learning.recipes.rollout.rate_hz", 0, ("rate_hz", "above 0")),
    ("learning.recipes.rollout.rollout_s", float("inf"), ("rollout_s = inf", "number")),
    ("learning.recipes.paper_split.beta", -1e-9, ("beta", "at least 0")),
    ("learning.recipes.rollout.validation_fraction", 0.95, ("validation_fraction", "below 0.9")),
    ("learning.recipes.rollout.history_steps", 0, ("history_steps", "at least 1")),
    ("learning.recipes.paper_split.batches", 10**9, ("batches", "at most 10000")),
    ("learning.recipes.rollout.epochs", "1e3.5", ("'1e3.5'", "whole number")),
    ("learning.recipes.rollout.epochs", None, ("epochs = None", "whole number")),
    ("learning.seeds", 10**9, ("learning.seeds", "at most 1000")),
    ("learning.sweep.trials", 10**9, ("sweep.trials", "at most 100000")),
    ("learning.sweep.epochs", 10**18, ("sweep.epochs", "at most 1e+06")),
    ("learning.sweep.recipe", "recordde", ("no 'recordde'", "did you mean 'recorded'")),
    ("learning.sweep.dataset", "case7", ("no 'case7'",)),
    ("learning.sweep.model", "base+joint_dampng", ("sweep.model: there is no 'joint_dampng'", "'joint_damping'?")),
    ("data.datasets.human_curls.test", ALL[1:], ("learning.sweep.dataset: human_curls has one training trial",)),
    ("learning.sweep.dimensions", {"hiden": {"low": 1, "high": 2}}, ("'hiden'", "did you mean 'hidden'")),
    ("learning.sweep.dimensions", {"hidden": {"low": 0, "high": 20}}, ("hidden.low", "at least 1")),
    ("learning.sweep.dimensions", {"hidden": {"low": 20, "high": 10}}, ("low 20 must be below high 10",)),
    (
        "learning.sweep.dimensions",
        {"hidden": {"low": 0, "high": 9, "log": True}},
        ("logarithm needs more than 0",),
    ),
    ("diagnosis.starts", 10**9, ("diagnosis.starts", "at most 1000")),
    ("diagnosis.angle_noise_deg", 0, ("angle_noise_deg", "above 0")),
    *(("data.wavelet.name", name, (f"'{name}'", "matching")) for name in ("morlet", "db", "db99", "haar2", "coif18")),
    ("data.wavelet.levels", 99, ("levels", "at most 8")),
    ("data.datasets.case1.samples", 10**9, ("samples", "at most 100000")),
    ("data.datasets.case1.trials", 1, ("trials", "at least 2")),
    ("data.datasets.case1.emg_noise", -0.1, ("emg_noise", "at least 0")),
    ("data.datasets.case1.arm", "leg", ("no 'leg'", "Known: arm26")),
    ("data.datasets.case1.hidden_effect", {"fatigu": {}}, ("no 'fatigu'", "did you mean 'fatigue'")),
    ("targets.models.case1", ["base+fatigu"], ("no 'fatigu'", "did you mean 'fatigue'")),
    ("targets.follow_verdict", ["case7"], ("follow_verdict", "'case7'")),
    ("data.datasets.bench_elbow.files", [], ("files", "not empty")),
    ("data.datasets.bench_elbow.files", [""], ("a path may not be empty",)),
    ("data.datasets.bench_elbow.files", ["a\nb.csv"], ("a path may not be empty or hold braces",)),
    ("data.datasets.bench_elbow.files", ["a\0b.csv"], ("a path may not be empty or hold braces",)),
    ("data.datasets.bench_elbow.test", [], ("test", "not empty")),
    ("data.datasets.bench_elbow.conditions", {"trial1": {"load": "FILL IN"}}, ("trial1.load: is still to fill in",)),
    ("data.datasets.bench_elbow.conditions", {"trial1": {"load": "2 kg"}}, ("'2 kg'", "a number")),
    ("data.datasets.bench_elbow.constants", {"tilt": 10}, ("tilt = 10", "at most 3.1")),
    ("data.datasets.bench_elbow.constants", {"load": 2000}, ("load = 2000", "at most 200")),
    ("physics.effect_files", ["a\nb.py"], ("a path may not be empty",)),
    ("physics.effect_files", ["/"], ("physics.effect_files.0 = '/'", "a folder; expected a file")),
    ("physics.arms.paper.muscles.Bi.path", {"file": "/"}, ("Bi.path.file = '/'", "a folder; expected a file")),
    ("tracking.uri", "mysql://db", ("tracking.uri", "matching")),
    ("tracking.uri", "sqlite:///", ("tracking.uri", "matching")),
    ("tracking.uri", "http://host\nEvil: header", ("tracking.uri", "matching")),
    ("tracking.uri", "sqlite:///results/a\nb.db", ("tracking.uri", "matching")),
    ("tracking.uri", "http://host with blanks", ("tracking.uri", "matching")),
    ("tracking.uri", "http://token@host", ("tracking.uri", "may not hold a user, password")),
    ("tracking.uri", "http://host?key=1", ("tracking.uri", "may not hold a user, password")),
    ("tracking.uri", "http://host/path;key=1", ("tracking.uri", "may not hold a user, password")),
]
NAMED = {f"{path} = {value!r:.40}": (path, value, says) for path, value, says in VALUES}
SESSIONS = {
    "a test trial as a maximum contraction": (
        {"mvc": ["c"]}, "mvc names c, which tests: what counts as 1 would know it"),
    "a maximum contraction with a test trial in it": (
        {"mvc": ["two"], "recordings": dict.fromkeys("abc", "two")},
        "mvc names two with c in it, which tests: .* cut them apart by cut_s"),
    "a part of the recording of a test trial that is not cut": (
        {"mvc": ["a"], "recordings": dict.fromkeys("abc", "two"), "cut_s": {"c": [9.0, 20.0]}},
        "mvc names a with c in it"),
    "a cut of a maximum contraction the wrong way round": ({"mvc": ["max"], "cut_s": {"max": [3, 1]}}, "cut_s of max"),
    "no such test trial": ({"test": ["d"]}, "no trial named d; the trials are a, b, c"),
    "all trials test": ({"test": ["a", "b", "c"]}, "every trial .a, b, c. is a test trial"),
    "a trial twice": ({"trials": ["a", "a", "c"]}, "a is there more than once"),
    "one trial": ({"trials": ["c"]}, "trials = .*not empty|expected"),
    "a cut the wrong way round": ({"cut_s": {"a": [3.0, 1.0]}}, "cut_s of a: expected"),
    "a cut of no trial": ({"cut_s": {"d": [1.0, 3.0]}}, "no trial named d"),
    "a band the wrong way round": ({"processing": {"band_pass_hz": [450, 20]}}, "the lower one first"),
    "a band of one end": ({"processing": {"band_pass_hz": [20]}}, "band_pass_hz"),
    "a corner above the rate": ({"processing": {"low_pass_hz": 10, "rate_hz": 20}}, "at most 0.4 of the rate"),
    "a rate of nothing": ({"processing": {"rate_hz": 1}}, "rate_hz = 1: expected a number.*at least 10"),
    "an offset of two days": ({"processing": {"emg_start_offset_s": 172800}}, "at most 86400"),
    "an offset of two days in a trial": ({"emg_start_offset_s": {"a": 172800}}, "offset_s.a = 172800.*at most 86400"),
    "an offset of no trial": ({"emg_start_offset_s": {"d": 1}}, "emg_start_offset_s: no trial named d; the trials"),
    "what is known twice": ({"conditions": {"a": {"tilt": 0.1}}}, "tilt is in conditions and also"),
    "another placeholder": ({"angle": {"file": "{name}/elbow.csv"}}, "the only placeholder is {trial}"),
    "a channel that is none": ({"emg": {"biceps": {"file": "x"}}}, "called emg_<muscle>"),
    "a signal that is none": ({"signals": {"tilt": {"file": "x"}}}, "end in _rad"),
    "a sign of 2": ({"angle": {"file": "x", "sign": 2}}, "sign = 2: expected 1 or -1"),
    "an offset of turns": ({"angle": {"file": "x", "offset_deg": 720}}, "at most 360"),
    "an unknown format": ({"angle": {"file": "x", "format": "xls"}}, "'xls': expected csv or"),
    "an unknown form": ({"emg": {"emg_biceps": {"file": "x", "form": "smooth"}}}, "'smooth': expected raw or envelope"),
    "no electrode for a muscle": ({"emg": {"emg_biceps": {"file": "x"}}}, "emg_triceps, which drives Tri in arm paper"),
    "a name with a placeholder": ({"trials": ["{a}", "b", "c"]}, "rename the trial"),
}  # fmt: skip
STUDIES = {
    "all trials of a study test": ({"questions": split(train=[], test=ALL)}, "train = .*not empty"),
    "a trial that trains and tests": ({"questions": split(train=ALL, test=ALL[:1])}, "load2.75_1 would train and test"),
    "no such trial in a study": ({"questions": split(train=ALL[1:], test=["load9"])}, "there is no 'load9'"),
    "no such question": ({"questions": {"why": {}}}, "held_out.questions"),
    "no such dataset in a study": ({"dataset": "case7"}, "held_out.dataset: there is no 'case7'"),
    "no such recipe in a study": ({"recipe": "recordde"}, "did you mean 'recorded'"),
    "too many scales in a study": ({"scales": [9]}, "held_out.scales"),
}  # fmt: skip
