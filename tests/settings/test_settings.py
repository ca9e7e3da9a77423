"""Settings: what is refused, and whether the message helps."""

import copy
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest
import yaml

from myowave.settings import (
    CurveSettings,
    Settings,
    SimulatedDataset,
    dump,
    parse_settings,
    public,
)
from myowave.settings.data import HIDDEN
from myowave.settings.keys import list_keys
from myowave.settings.learning import RECIPES

ROOT = Path(__file__).parents[2]
SHIPPED = yaml.safe_load((ROOT / "config.yaml").read_text())


def changed(path: str, value: object, *, remove: bool = False) -> dict:
    """The shipped configuration with one key set or removed."""
    config = copy.deepcopy(SHIPPED)
    *parents, last = path.split(".")
    section = config
    for part in parents:
        section = section.setdefault(part, {})
    if remove:
        del section[last]
    else:
        section[last] = value
    return config


def problems(config: dict) -> list[str]:
    with pytest.raises(ValueError) as caught:
        parse_settings(config)
    return str(caught.value).splitlines()


def test_the_shipped_configuration_is_accepted_and_survives_a_round_trip():
    settings = parse_settings(SHIPPED)
    assert parse_settings(dump(settings)) == settings


def places(section: object, path: tuple = ()) -> Iterator[tuple]:
    """Paths of everything below a section."""
    children = section.items() if isinstance(section, dict) else enumerate(section if isinstance(section, list) else ())
    for key, value in children:
        yield (*path, key)
        yield from places(value, (*path, key))


NONSENSE = (None, True, -1, 1e30, "", "x$y{z}", [], {}, [None], {"a": None}, {1: 2}, [[1]], float("nan"))


def test_nonsense_anywhere_is_a_message_and_never_a_traceback():
    everywhere, random = list(places(SHIPPED)), Random(1)
    for _ in range(300):
        config, (*parents, last) = copy.deepcopy(SHIPPED), random.choice(everywhere)
        section = config
        for part in parents:
            section = section[part]
        section[last] = random.choice(NONSENSE)
        try:
            parse_settings(config)
        except ValueError as error:
            assert max(map(len, str(error).splitlines())) < 1000


@pytest.mark.parametrize(
    ("name", "meant"),
    [("slak", "slack"), ("slack_Bii", "slack_Bi"), ("yielding_curv", "yielding_curve"), ("curve", "")],
)
def test_scatter_of_a_constant_that_no_arm_has_is_refused(name, meant):
    (line,) = problems(changed(f"diagnosis.scatter.{name}", {"absolute": 0.1}))
    assert line.startswith(f"diagnosis.scatter.{name}: there is no {name!r}") and f"{meant!r}" * bool(meant) in line
    assert "pennation" in line and "onset_curve" in line


@pytest.mark.parametrize("name", ["pennation", "slack_Tri", "slack_BIClong", "strength", "length_flexors", "tilt"])
def test_scatter_may_be_that_of_a_constant_of_all_muscles_or_of_one_in_any_arm(name):
    settings = parse_settings(changed(f"diagnosis.scatter.{name}", {"relative": 0.1}))
    assert settings.diagnosis.scatter[name].relative == 0.1 and "vmax" in settings.diagnosis.scatter


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ({"relative": -0.1}, ("-0.1", "at least 0")),
        ({"relative": 5}, ("5", "at most 1", "share")),
        ({"absolute": "much"}, ("'much'", "number")),
        ({"relativ": 0.1}, ("did you mean 'relative'",)),
        (0.1, ("0.1", "section")),
    ],
)
def test_scatter_that_is_no_deviation_is_refused(value, says):
    (line,) = problems(changed("diagnosis.scatter.slack", value))
    assert line.startswith("diagnosis.scatter.slack") and all(part in line for part in says), line


@pytest.mark.parametrize(
    "address",
    [
        "postgresql://me:hunter2@db.example/sweeps",
        "postgresql://me:hunter2/x@y@db.example/sweeps",
        "postgresql://me@db.example/sweeps?password=hunter2",
        "https://hunter2@mlflow.example",
        "https://mlflow.example?key=hunter2",
        "https://mlflow.example/api;key=hunter2",
        "https://mlflow.example;hunter2/api",
        "https://:hunter2 @mlflow.example",
    ],
)
def test_a_password_is_refused_and_never_shown(address):
    (line,) = problems(changed("tracking.uri", address))
    assert "tracking.uri" in line and "may not hold a user, password" in line and "hunter2" not in line


def test_a_password_is_not_shown_by_what_is_wrong_around_it():
    assert "hunter2" not in str(problems(changed("tracking", ["http://me:hunter2@mlflow.example"])))


def test_a_heavier_forearm_needs_the_inertia_that_goes_with_it():
    config = changed("data.datasets.human_curls.constants", {"mass": 9.0})
    assert "inertia is" in problems(config)[0] and "mass com^2" in problems(config)[0]


@pytest.mark.parametrize(
    ("path", "meant"),
    [
        ("lerning", "learning"),
        ("learning.recipes.rollout.hiden", "hidden"),
        ("physics.arms.paper.muscles.Tri.f0_n", "f0_N"),
        ("data.datasets.case1.sampels", "samples"),
        ("data.datasets.bench_elbow.fils", "files"),
    ],
)
def test_an_unknown_key_is_refused_and_the_nearest_known_one_is_named(path, meant):
    (line,) = problems(changed(path, 1))
    assert line.startswith(f"{path}: unknown key; did you mean {meant!r}?")


def test_a_missing_key_is_named_with_its_meaning():
    (line,) = problems(changed("physics.arms.paper.muscles.Bi.f0_N", None, remove=True))
    assert line.startswith("physics.arms.paper.muscles.Bi.f0_N: is missing") and "[N]" in line and "isometric" in line


def test_every_problem_is_reported_at_once():
    config = changed("learning.seeds", 0)
    config["physics"]["arms"]["paper"]["joint"]["mass_kg"] = -1
    config["data"]["wavelet"] = {"nam": "db2"}
    assert len(problems(config)) == 3


@pytest.mark.parametrize(("key", "value"), [("name", "bior2.2"), ("name", "mexican hat"), ("levels", -1)])
def test_only_orthogonal_wavelets_and_coarser_scales_are_taken(key, value):
    (line,) = problems(changed(f"data.wavelet.{key}", value))
    assert line.startswith(f"data.wavelet.{key} = {value!r}: expected")


def test_trials_may_be_named_by_numbers():
    config = changed("data.datasets.case1.test", [3])
    config["data"]["datasets"]["case1"]["conditions"] = {4: {"load": 1.0}}
    dataset = parse_settings(config).data.datasets["case1"]
    assert dataset.test == ("3",) and dataset.conditions == {"4": {"load": 1.0}}


def test_numbers_given_as_text_are_read_as_numbers():
    # YAML reads 1e-3 as text, and so does `snakemake --config`.
    settings = parse_settings(changed("learning.recipes.rollout.learning_rate", "1e-3"))
    assert settings.learning.recipes["rollout"].learning_rate == 1e-3


def test_what_is_hidden_in_a_dataset_is_not_public():
    config = changed("data.datasets.case1.hidden_effect", {"joint_damping": {"c": 1.2}})
    dataset = parse_settings(config).data.datasets["case1"]
    assert dump(dataset)["hidden_effect"] == {"joint_damping": {"c": 1.2}}
    shown = public(dataset)
    assert not HIDDEN & set(shown) and "joint_damping" not in str(shown)
    assert SimulatedDataset.model_validate(shown).samples == dataset.samples


@pytest.mark.parametrize(
    "path",
    [
        "physics.arms.paper",
        "data.datasets.case1",
        "data.datasets.bench_elbow",
        "learning.recipes.paper_split",
        "diagnosis",
    ],
)
def test_a_section_given_to_a_job_is_the_section_of_the_settings(path):
    section = parse_settings(SHIPPED)
    for part in path.split("."):
        section = section[part] if isinstance(section, dict) else getattr(section, part)
    assert type(section).model_validate(json.loads(json.dumps(dump(section)))) == section


def test_each_method_has_settings_of_its_own():
    (problem,) = problems(changed("learning.recipes.paper_split.simulated_trials", 4))
    assert problem.startswith("learning.recipes.paper_split.simulated_trials: unknown key") and "batches" in problem
    (problem,) = problems(changed("learning.recipes.rollout.method", "papers"))
    assert problem == "learning.recipes.rollout.method = 'papers': expected paper or rollout."
    (problem,) = problems(changed("learning.recipes.rollout.method", None, remove=True))
    assert problem.startswith("learning.recipes.rollout.method = None: expected paper or rollout")


def test_settings_cannot_be_changed():
    settings = parse_settings(SHIPPED)
    with pytest.raises(ValueError, match="frozen"):
        settings.physics.arms["paper"].joint.mass_kg = 2.0


def test_every_key_says_what_it_means_and_numbers_have_a_unit():
    for key in list_keys(Settings):
        assert key.meaning, f"{key.name} has no description"
        if key.allowed.startswith(("a number", "a whole number")):
            assert key.unit, f"{key.name} has no unit"


def test_users_own_effects_are_left_to_the_jobs():
    config = changed("targets.models.case1", ["base+my_effect"])
    config["physics"]["effect_files"] = ["my_effect.py"]
    parse_settings(config)


def test_the_shipped_file_spells_out_every_key_of_its_recipes():
    for name, recipe in SHIPPED["learning"]["recipes"].items():
        assert set(recipe) == set(RECIPES[recipe["method"]].model_fields), (
            f"recipe {name} leaves choices to hidden defaults"
        )


def test_the_curves_of_the_settings_are_those_of_the_physics():
    from myowave.physics.curves import FAMILIES

    for field, of_taneja in (("active_length", "taneja"), ("passive", "taneja"), ("force_velocity", "hill")):
        names = set(CurveSettings.model_fields[field].annotation.__args__)
        assert names == {of_taneja if name == "taneja" else name for name in set(FAMILIES) - {"hill"}}
    assert FAMILIES["hill"] is FAMILIES["taneja"]


def test_reading_settings_loads_nothing_heavy():
    code = (
        "import sys, myowave.settings, myowave.workflow.digest, myowave.cli\n"
        "heavy = {'torch', 'mlflow', 'pandas', 'numpy', 'scipy', 'matplotlib', 'snakemake'} & set(sys.modules)\n"
        "sys.exit(', '.join(sorted(heavy)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("text", "says"), [("learning: [", "not valid YAML"), ("- 1", "sections"), ("physics: {}", "physics.arms")]
)
def test_the_command_explains_a_wrong_file_without_a_traceback(tmp_path, text, says):
    path = tmp_path / "mine.yaml"
    path.write_text(text)
    done = subprocess.run(
        [sys.executable, "-m", "myowave.cli", "effects", "--config", str(path)], capture_output=True, text=True
    )
    assert done.returncode == 2 and says in done.stderr and "Traceback" not in done.stderr


def test_a_newcomer_sees_on_one_screen_what_to_change():
    screen, _, science = (ROOT / "config.yaml").read_text().partition("# ---- What follows")
    assert len(screen.splitlines()) <= 50 and set(yaml.safe_load(screen)) == {"targets", "data"}
    assert "recipes:" in science and len({key.name for key in list_keys(Settings) if not key.section}) <= 180
