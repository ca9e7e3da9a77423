"""Settings from files, each laid over those before."""

from pathlib import Path

import pytest

from myowave.settings.files import read_settings

CONFIG = Path(__file__).parents[2] / "config.yaml"


def test_a_second_configuration_is_laid_over_the_first(tmp_path):
    mine = tmp_path / "mine.yaml"
    mine.write_text("tracking: {uri: 'http://server:5000'}\ntargets: {datasets: [case1]}\n", encoding="utf-8")
    ours = read_settings([CONFIG])
    both = read_settings([CONFIG, mine])
    assert both.tracking.uri == "http://server:5000" and both.targets.datasets == ("case1",)
    assert both.data == ours.data and both.targets.scales == ours.targets.scales


def test_a_configuration_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ValueError, match="There is no .*missing.yaml"):
        read_settings([tmp_path / "missing.yaml"])
