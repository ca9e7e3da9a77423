"""A table of subjects becomes datasets, and every fault of it is named with its row."""

import pytest

from myowave.physics.anthropometry import forearm_with_hand
from myowave.settings import parse_settings
from myowave.settings.data import real_dataset
from myowave.settings.subjects import add_subjects

TABLE = """subject,files,test,mass,length,trial4.load
ann,data/ann/*.csv,trial3 trial5,1.2,0.35,1.5
bob,data/bob/*.csv,trial3,1.4,,
"""


@pytest.fixture
def config(tmp_path):
    """A configuration with the table; `config(text)` replaces it."""

    def with_table(text=TABLE):
        path = tmp_path / "subjects.csv"
        path.write_text(text)
        return {
            "data": {"subjects": str(path), "datasets": {"case1": {"kind": "simulated"}}},
            "targets": {"datasets": ["case1", "subjects"], "models": {"subjects": ["base", "base+x"]}},
        }

    return with_table


def test_each_row_is_a_measured_dataset(config):
    datasets = add_subjects(config())["data"]["datasets"]
    assert list(datasets) == ["case1", "ann", "bob"]
    assert datasets["ann"] == {
        "kind": "measured",
        "files": ["data/ann/*.csv"],
        "test": ["trial3", "trial5"],
        "constants": {"mass": 1.2, "length": 0.35},
        "conditions": {"trial4": {"load": 1.5}},
    }
    assert datasets["bob"]["constants"] == {"mass": 1.4} and datasets["bob"]["conditions"] == {}


def test_a_spreadsheet_may_write_semicolons(config):
    read, written = (add_subjects(config(text))["data"]["datasets"] for text in (TABLE.replace(",", ";"), TABLE))
    assert read == written


def test_a_subject_may_name_its_arm(config):
    table = "subject,files,test,arm\nann,a.csv,trial3,arm26\nbob,b.csv,trial3,\n"
    datasets = add_subjects(config(table))["data"]["datasets"]
    assert datasets["ann"]["arm"] == "arm26" and "arm" not in datasets["bob"]
    assert datasets["ann"]["constants"] == {}


def test_a_subject_s_angle_may_be_turned(config):
    table = "subject,files,test,angle.sign,angle.offset_deg\nann,a.csv,t3,-1,180\nbob,b.csv,t3,,\ncid,c.csv,t3,2,\n"
    datasets = add_subjects(config(table))["data"]["datasets"]
    turned, plain = (real_dataset(datasets[name]).angle for name in ("ann", "bob"))
    assert (turned.sign, turned.offset_deg, plain.sign, plain.offset_deg) == (-1, 180.0, 1, 0.0)
    assert not datasets["ann"]["conditions"]
    with pytest.raises(ValueError, match=r"angle.sign"):
        real_dataset(datasets["cid"])


def test_body_measures_stand_for_the_forearms_constants_unless_these_are_there(config):
    table = (
        "subject,files,test,arm,body_mass,height,sex,com\n"
        "ann,a.csv,t3,arm26,60,1.7,f,\nbob,b.csv,t3,arm26,60,1.7,f,0.2\ncid,c.csv,t3,,,,,\n"
    )
    datasets = add_subjects(config(table))["data"]["datasets"]
    forearm = {name: estimate.value for name, estimate in forearm_with_hand(60, 1.7, "f").items()}
    assert datasets["ann"]["constants"] == forearm and set(forearm) == {"mass", "com", "inertia", "grip"}
    assert datasets["bob"]["constants"] == {**forearm, "com": 0.2}
    assert datasets["cid"]["constants"] == {}


@pytest.mark.parametrize(
    ("cells", "says"),
    [
        ("60,,f", "row 2: body_mass, sex without height; fill in all three, or none"),
        ("60,170,f", "row 2: height is 170; expected 1.2 to 2.3 m"),
        ("60,tall,f", "row 2, column height: 'tall' is not a number"),
    ],
)
def test_body_measures_that_cannot_be_are_named_with_their_row(config, cells, says):
    with pytest.raises(ValueError, match=says):
        add_subjects(config(f"subject,files,test,body_mass,height,sex\nann,a.csv,t3,{cells}\n"))


def test_the_word_subjects_stands_for_all_of_them(config):
    targets = add_subjects(config())["targets"]
    assert targets["datasets"] == ["case1", "ann", "bob"]
    assert targets["models"] == {"ann": ["base", "base+x"], "bob": ["base", "base+x"]}


def test_a_configuration_without_a_table_stays_as_it_is():
    config = {"data": {"datasets": {}}, "targets": {"datasets": ["case1"]}}
    assert add_subjects(config) == config


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TABLE.replace("1.4", "heavy"), "row 3, column mass: 'heavy' is not a number"),
        (TABLE.replace("bob", "ann"), "row 3: subject 'ann' is there already"),
        (TABLE.replace("\nbob", "\n\n\nann"), "row 5: subject 'ann' is there already"),
        (TABLE.replace("length", "mass"), "row 1: column mass is there more than once"),
        (TABLE.replace("bob", "case1"), "case1 .* is also in data.datasets"),
        (TABLE.replace(",test,", ",tests,"), "row 2: nothing in column test"),
        (TABLE.replace("1.4,,", "1.4,,,7"), "row 3: more cells than columns"),
        (TABLE.replace("bob,data/bob/*.csv,trial3,1.4,,", "bob"), "row 3: nothing in column files, test"),
        (TABLE.replace("bob,", ","), "row 3: nothing in column subject"),
        (TABLE.replace("bob,data", 'bob,"data'), "is not a CSV table in UTF-8"),
    ],
)
def test_faults_are_named(config, text, message):
    with pytest.raises(ValueError, match=message):
        add_subjects(config(text))


def test_a_table_that_is_not_there(config):
    settings = config()
    settings["data"]["subjects"] = "nowhere.csv"
    with pytest.raises(ValueError, match="there is no table nowhere.csv"):
        add_subjects(settings)


def test_sections_of_another_kind_are_left_to_the_settings_to_refuse(config):
    for wrong in (
        {"targets": [1]},
        {"targets": {"datasets": 3, "models": 4}},
        {"data": {"subjects": 7}},
        {"data": [1]},
    ):
        with pytest.raises(ValueError, match="expected|missing"):
            parse_settings(add_subjects(config() | wrong))
