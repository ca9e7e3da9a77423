import shutil
from pathlib import Path

import pytest
import yaml

from myowave.settings import parse_settings
from myowave.settings.files import lay_over

ROOT = Path(__file__).parents[2]


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    """A folder with config.yaml and the preset arms, to work in."""
    shutil.copy(ROOT / "config.yaml", tmp_path)
    for arm in ("arm26", "arm26_brd"):
        shutil.copytree(ROOT / "data" / arm, tmp_path / "data" / arm)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def laid_over(workplace):
    """Settings of a text laid over config.yaml, as Snakemake does it."""

    def settings(text):
        text = text.replace("load: FILL IN", "load: 0.0")  # as the person does
        return parse_settings(lay_over(yaml.safe_load(Path("config.yaml").read_text()), yaml.safe_load(text)))

    return settings
