"""Fixtures of the workflow's tests."""

from pathlib import Path

import pytest
from project_copy import Project, copy_project


@pytest.fixture
def project(tmp_path: Path) -> Project:
    """A fresh copy of the project."""
    return copy_project(tmp_path)
