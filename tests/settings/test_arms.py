"""Arms of several kinds side by side: each dataset has its own, written out or a preset with what differs from it."""

import copy
import shutil
from pathlib import Path

import pytest
import yaml

from myowave.models import build_model
from myowave.settings import Physics, dump, parse_settings
from myowave.settings.configuration import Settings

ROOT = Path(__file__).parents[2]
SHIPPED = yaml.safe_load((ROOT / "config.yaml").read_text())
ELBOW = {
    "side": "flexor", "emg": "emg_biceps", "f0_N": 900.0, "l0_m": 0.1, "vmax_m_s": 1.0, "slack_m": 0.25,
    "l1_m": 0.04, "l2_m": 0.3,
}  # fmt: skip
ARM = {"muscles": {"Flex": ELBOW}, "joint": SHIPPED["physics"]["arms"]["paper"]["joint"]}
ITS_OWN = {"identify": {"f0_Flex": {"start_spread": 0.1}}}


def config_with(arms: dict, **of_bench_elbow) -> dict:
    """The shipped configuration with these arms, and other settings of one measured dataset."""
    config = copy.deepcopy(SHIPPED)
    config["physics"]["arms"] = {**config["physics"]["arms"], **arms}
    config["data"]["datasets"]["bench_elbow"] |= of_bench_elbow
    return config


def problems(config: dict) -> str:
    with pytest.raises(ValueError) as caught:
        parse_settings(config)
    return str(caught.value)


@pytest.fixture
def presets(tmp_path, monkeypatch):
    """A folder where the preset `small` ships beside the others."""
    for shipped in ("arm26", "arm26_brd"):
        shutil.copytree(ROOT / "data" / shipped, tmp_path / "data" / shipped)
    (tmp_path / "data/small").mkdir(parents=True)
    (tmp_path / "data/small/small.yaml").write_text(yaml.safe_dump(ARM | {"curves": {"passive": "millard"}}))
    monkeypatch.chdir(tmp_path)


def test_a_dataset_has_the_arm_that_it_names_or_that_of_the_paper():
    settings = parse_settings(config_with({"thin": ARM}, arm="thin", **ITS_OWN))
    assert list(settings.physics_of("bench_elbow").muscles) == ["Flex"]
    assert settings.physics_of("bench_elbow").muscles == settings.physics.arms["thin"].muscles
    default = settings.physics_of("case1")
    assert default.muscles == settings.physics.arms["paper"].muscles and list(default.muscles) == ["Bi", "Tri"]


def test_the_physics_of_a_dataset_is_all_that_a_job_needs_and_holds_no_other_arm():
    other = {"muscles": {"Other": ELBOW}, "joint": ARM["joint"]}
    settings = parse_settings(config_with({"thin": ARM, "other": other}, arm="thin", **ITS_OWN))
    given = dump(settings.physics_of("bench_elbow"))
    assert "Other" not in str(given) and "Bi" not in given["muscles"]
    assert Physics.model_validate(given) == settings.physics_of("bench_elbow")
    assert set(build_model("base", Physics.model_validate(given)).defaults) == set(
        settings.physics.arms["thin"].nominal
    )


def test_a_change_of_one_arm_changes_the_physics_of_no_other_dataset():
    def physics(settings: Settings) -> dict:
        return {name: dump(settings.physics_of(name)) for name in settings.data.datasets}

    stronger = {"muscles": {"Flex": ELBOW | {"f0_N": 950.0}}, "joint": ARM["joint"]}
    one = physics(parse_settings(config_with({"thin": ARM}, arm="thin", **ITS_OWN)))
    other = physics(parse_settings(config_with({"thin": stronger}, arm="thin", **ITS_OWN)))
    assert {name for name in one if one[name] != other[name]} == {"bench_elbow"}


def test_effect_files_are_those_of_every_arm():
    config = config_with({"thin": ARM}, arm="thin", **ITS_OWN)
    config["physics"]["effect_files"] = ["mine.py"]
    settings = parse_settings(config)
    assert settings.physics_of("bench_elbow").files == settings.physics_of("case1").files == ("mine.py",)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"arm": "thinn"}, "bench_elbow.arm: there is no 'thinn'; did you mean 'thin'"),
        ({"arm": "thin", "identify": {"f0_Bi": {}}}, "bench_elbow.identify.f0_Bi: there is no 'f0_Bi' in arm thin"),
        ({"arm": "thin", **ITS_OWN, "constants": {"l1_Bi": 0.3}}, "bench_elbow.constants.l1_Bi: .* in arm thin"),
        ({"arm": "thin", **ITS_OWN, "conditions": {"trial1": {"lode": 1}}}, "lode: .*in arm thin; did you mean 'load'"),
        (ITS_OWN, "bench_elbow.identify.f0_Flex: there is no 'f0_Flex' in arm paper"),
    ],
)
def test_names_are_looked_up_in_the_datasets_own_arm(changes, says):
    config = config_with({"thin": ARM}, **changes)
    with pytest.raises(ValueError, match=says):
        parse_settings(config)


def test_a_channel_that_an_arm_needs_and_a_recorder_did_not_record_is_one_problem():
    muscles = {name: ELBOW | {"emg": "emg_brachialis"} for name in ("Long", "Short")}
    config = config_with({"other": {"muscles": muscles, "joint": ARM["joint"]}})
    config["data"]["datasets"]["human_curls"] |= {"arm": "other", "identify": {"f0_Long": {}}}
    said = problems(config)
    assert "human_curls.emg: emg_brachialis, which drives Long, Short in arm other, is not here" in said
    assert said.count("is not here") == 1


def test_a_faulty_arm_is_explained_where_it_is():
    said = problems(config_with({"thin": {"muscles": {"Flex": ELBOW | {"f0_N": -1}}, "joint": {}}}))
    assert "physics.arms.thin.muscles.Flex.f0_N = -1: expected a number, above 0, at most 100000 [N]" in said
    assert "physics.arms.thin.joint.mass_kg: is missing" in said


def test_a_dataset_that_names_nothing_to_identify_gets_what_is_usual_for_its_arm():
    config = config_with({})
    for name, arm in (("bench_elbow", "paper"), ("human_curls", "arm26")):
        config["data"]["datasets"][name].pop("identify", None)
        config["data"]["datasets"][name]["arm"] = arm
    datasets = parse_settings(config).data.datasets
    assert set(datasets["bench_elbow"].identify) == {"f0_Bi", "l0_Bi", "f0_Tri", "l0_Tri"}
    groups = {f"{c}_{g}" for c in ("strength", "length") for g in ("flexors", "extensors")}
    assert set(datasets["human_curls"].identify) == groups


# ---- presets


def test_a_preset_is_an_arm_and_what_stands_beside_it_counts_more(presets):
    mine = {"preset": "small", "muscles": {"Flex": {"f0_N": 1.0}, "More": ELBOW}, "curves": {"passive": "degroote"}}
    physics = parse_settings(config_with({"small": {"preset": "small"}, "mine": mine})).physics
    small, changed = physics.arms["small"], physics.arms["mine"]
    assert small.muscles["Flex"].f0_N == 900.0 and small.curves.passive == "millard"
    assert changed.muscles["Flex"] == small.muscles["Flex"].model_copy(update={"f0_N": 1.0})
    assert list(changed.muscles) == ["Flex", "More"] and changed.curves.passive == "degroote"


def test_null_takes_a_muscle_of_a_preset_out(presets):
    mine = {"preset": "small", "muscles": {"Flex": None, "More": ELBOW}}
    assert list(parse_settings(config_with({"mine": mine})).physics.arms["mine"].muscles) == ["More"]


def test_the_physics_of_a_dataset_does_not_ask_for_its_preset_again(presets):
    settings = parse_settings(config_with({"mine": {"preset": "small"}}, arm="mine", **ITS_OWN))
    given = dump(settings.physics_of("bench_elbow"))
    Path("data/small/small.yaml").unlink()
    assert Physics.model_validate(given).muscles["Flex"].f0_N == 900.0


def test_a_preset_that_is_not_there_is_named_with_those_that_are(presets):
    said = problems(config_with({"mine": {"preset": "smal"}}))
    assert "physics.arms.mine: there is no preset 'smal'" in said and "Presets here: arm26, arm26_brd, small" in said


def test_a_preset_that_is_no_yaml_is_explained(presets):
    Path("data/small/small.yaml").write_text("muscles: [")
    assert "data/small/small.yaml is not valid YAML" in problems(config_with({"mine": {"preset": "small"}}))
