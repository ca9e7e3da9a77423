"""Settings from files, each laid over those before, and what is said of a file that cannot be read."""

from pathlib import Path

import pytest

from myowave.settings import read_settings
from myowave.settings.files import check_command_line, read_yaml

CONFIG = Path(__file__).parents[2] / "config.yaml"
_TEN = ", ".join(["*{}"] * 10)
BOMB = "a: &a [x]\n" + "".join(
    f"{b}: &{b} [{_TEN.replace('{}', a)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)


def test_a_second_configuration_is_laid_over_the_first(tmp_path):
    mine = tmp_path / "mine.yaml"
    mine.write_text("tracking: {uri: 'http://server:5000'}\ntargets: {datasets: [case1]}\n", encoding="utf-8")
    ours = read_settings([CONFIG])
    both = read_settings([CONFIG, mine])
    assert both.tracking.uri == "http://server:5000" and both.targets.datasets == ("case1",)
    assert both.data == ours.data and both.targets.scales == ours.targets.scales


def test_a_file_that_is_laid_over_another_says_so_where_it_is_read_alone(tmp_path):
    mine = tmp_path / "mine.yaml"
    mine.write_text("targets: {datasets: [case1]}\ndata: {datasets: {}}\n", encoding="utf-8")
    with pytest.raises(ValueError, match="(?s)learning: is missing.*config.yaml has all sections: name it before"):
        read_settings([mine])
    mine.write_text("learning: {seeds: 0}\n", encoding="utf-8")
    with pytest.raises(ValueError, match="^learning.seeds = 0: expected[^\n]*$"):
        read_settings([CONFIG, mine])


def test_a_key_may_have_a_colon(tmp_path):
    mine = tmp_path / "mine.yaml"
    mine.write_text("a: {t:1: {load: 2}, 'b:2': , c: http://host:1}\nat 9:30:\n", encoding="utf-8")
    assert read_yaml(mine) == {"a": {"t:1": {"load": 2}, "b:2": None, "c": "http://host:1"}, "at 9:30": None}


def test_a_configuration_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ValueError, match="There is no .*missing.yaml"):
        read_settings([tmp_path / "missing.yaml"])


FAULTS = {
    "an open bracket": (
        b"targets: {datasets: [case1\nphysics: 1\n",
        "mine.yaml is not valid YAML, line 2, column 8: exp",
    ),
    "a tab": (b"targets:\n\tdatasets: []\n", "mine.yaml is not valid YAML, line 2, column 1: found character"),
    "no colon": (b"targets:\n  datasets [case1]\n  x: 1\n", "mine.yaml is not valid YAML, line 3"),
    "a stray quote": (b"targets: 'case1\n", "mine.yaml is not valid YAML, line 2"),
    "an unknown alias": (b"targets: *case\n", "mine.yaml is not valid YAML, line 1, column 10: found undefined alias"),
    "an object of Python": (b"targets: !!python/object:os.system {}\n", "mine.yaml is not valid YAML, line 1"),
    "a control sign": (b"targets: \x00\n", "mine.yaml is not valid YAML: unacceptable character"),
    "another encoding": ("targets: größer\n".encode("latin-1"), "mine.yaml: this is not UTF-8 text"),
    "a key twice": (
        b"targets: {}\ndata: {}\ntargets: {}\n",
        "line 3, column 1: the key targets is there already, line 1",
    ),
    "a key twice inside": (
        b"data:\n  x: 1\n  x: 2\n",
        "mine.yaml is not valid YAML, line 3, column 3: the key x is there already",
    ),
    "no space behind a colon": (
        b"data:\n  constants: {mass:1.4, load: 2}\n",
        "mine.yaml is not valid YAML, line 2, column 15: mass:1.4 needs a space behind the colon, mass: 1.4. Correct",
    ),
    "aliases within aliases": (
        BOMB.encode(),
        "mine.yaml is not valid YAML, line 1, column 1: aliases within aliases make it",
    ),
    "an alias of itself": (b"data: &a [*a]\n", "aliases within aliases make it huge"),
    "depth without end": (b"data: " + b"[" * 5000, "mine.yaml: sections within sections without end"),
    "no day of the calendar": (b"data: 2026-02-31\n", "mine.yaml is not valid YAML: day is out of range for month"),
    "nothing": (b"# later\n", "mine.yaml: expected sections such as physics and data; found nothing"),
    "a list": (b"- targets\n", "mine.yaml: expected sections such as physics and data; found list"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_a_file_is_named_with_its_line(tmp_path, monkeypatch, fault):
    text, says = FAULTS[fault]
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_bytes(text)
    with pytest.raises(ValueError) as caught:
        read_settings([CONFIG, Path("mine.yaml")])
    assert says in str(caught.value) and len(str(caught.value).splitlines()) == 1


def test_a_folder_is_no_configuration(tmp_path):
    with pytest.raises(ValueError, match="cannot be read"):
        read_settings([tmp_path])


def test_aliases_and_merged_sections_stay_allowed(tmp_path):
    text = "data: {datasets: {a: &a {seed: 1}, b: {<<: *a, seed: 2}}}\ntargets: {datasets: [case1]}\n"
    (tmp_path / "mine.yaml").write_text(text)
    with pytest.raises(ValueError, match="data.datasets.a.kind") as caught:
        read_settings([CONFIG, tmp_path / "mine.yaml"])
    assert "already" not in str(caught.value)


def test_a_command_of_snakemake_ends_where_one_of_its_files_cannot_be_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    good = ["--cores", "2", "all", "--configfile", str(CONFIG)]
    check_command_line(good)
    check_command_line(["--config", "x=1", "-n"])
    for arguments in ([*good, "nope.yaml"], ["--configfiles", "nope.yaml", "--", "all"], ["--configfile=nope.yaml"]):
        with pytest.raises(SystemExit, match="nothing was run.\nThere is no nope.yaml in"):
            check_command_line(arguments)
    Path("config.yaml").write_text("targets: [")
    with pytest.raises(SystemExit, match="config.yaml is not valid YAML, line 1"):
        check_command_line(["-n"])
