"""`myowave settings`: groups first, then the keys of one, or those about a word."""

import pytest
from typer.testing import CliRunner

from myowave.cli import app
from myowave.settings import Settings
from myowave.settings.keys import find_keys, list_groups, list_keys

KEYS = list_keys(Settings)


def names(*words: str) -> list[str]:
    return [key.name for key in find_keys(KEYS, words)]


def asked(*arguments: str):
    return CliRunner().invoke(app, ["settings", *arguments])


def test_groups_fit_on_a_screen_and_count_every_key_once():
    groups = list_groups(KEYS)
    sections = {key.name for key in KEYS if any(k.name.startswith(f"{key.name}.") for k in KEYS)}
    assert sum(count for count, _ in groups.values()) == len({key.name for key in KEYS} - sections)
    assert len(asked().output.splitlines()) == len(groups) + 1 <= 24
    assert groups["data.wavelet"][0] == len(names("data.wavelet")) - 1, "and the section itself"


def test_a_group_is_listed_whole_and_nothing_else():
    assert names("data.wavelet")[0] == "data.wavelet"
    assert all(name.startswith("data.wavelet") for name in names("data.wavelet"))
    assert "targets.scales" in names("targets") and "learning.sweep.scales" not in names("targets")


def test_a_word_finds_keys_by_name_or_meaning_and_more_words_fewer():
    assert {"data.datasets.<dataset>.angle_noise_deg", "learning.recipes.<recipe>.history_noise"} <= set(names("Noise"))
    assert names("noise", "angle", "estimated") == ["diagnosis.angle_noise_deg"]
    assert "data.datasets.<dataset>.conditions" in names("load"), "what new leaves to fill in"


def test_a_key_is_printed_with_unit_default_and_bounds():
    output = asked("learning_rate").output
    assert "learning.recipes.<recipe>.learning_rate" in output and "above 0" in output


def test_all_is_every_key():
    assert asked("--all").output.count("\n") == 2 * len(KEYS)


@pytest.mark.parametrize(("word", "near"), [("wavelett", "did you mean 'wavelet'?"), ("no such thing", "No setting")])
def test_a_word_that_is_nowhere_is_said(word, near):
    result = asked(word)
    assert result.exit_code == 2 and near in result.output
