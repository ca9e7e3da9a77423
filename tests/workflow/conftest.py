"""Fixtures of the workflow's tests."""

from pathlib import Path
from typing import Any

import pytest
import yaml
from project_copy import ROOT, Project, copy_project


@pytest.fixture
def project(tmp_path: Path) -> Project:
    """A fresh copy of the project."""
    return copy_project(tmp_path)


@pytest.fixture
def settings_file() -> dict[str, Any]:
    """The configuration that ships, as it is written."""
    return yaml.safe_load((ROOT / "config.yaml").read_text())
