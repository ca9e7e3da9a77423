"""YAML files as plain data, and one laid over another."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml


def read_yaml(path: Path, such_as: str) -> dict[str, Any]:
    """The sections in a YAML file.

    Args:
        such_as: sections that are expected in it, for the message.

    Raises:
        ValueError: for a file that is not YAML, or holds no sections.
    """
    try:
        values = yaml.safe_load(path.read_text(encoding="utf-8"))
    except yaml.YAMLError as error:
        raise ValueError(f"{path} is not valid YAML: {error}") from None
    if not isinstance(values, dict):
        raise ValueError(f"{path}: expected sections such as {such_as}; found {type(values).__name__}.")
    return values


def lay_over(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Two configurations as one: mappings are joined, everything else is taken from above."""
    both = {k: lay_over(below[k], above[k]) for k in below.keys() & above.keys() if _mappings(below[k], above[k])}
    return {**below, **above, **both}


def _mappings(*values: object) -> bool:
    return all(isinstance(value, Mapping) for value in values)
