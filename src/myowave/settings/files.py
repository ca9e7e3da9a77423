"""Settings from YAML files, outside of the workflow, where Snakemake reads them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from myowave.settings.configuration import Settings
from myowave.settings.parsing import parse_settings
from myowave.settings.subjects import add_subjects


def read_settings(paths: Sequence[Path]) -> Settings:
    """The settings in YAML files, each laid over those before, as after Snakemake's --configfile.

    Raises:
        ValueError: for a file that is not there, is not YAML, or has wrong keys.
    """
    config: dict[str, Any] = {}
    for path in paths:
        config = lay_over(config, read_yaml(path))
    return parse_settings(add_subjects(config))


def read_yaml(path: Path) -> dict[str, Any]:
    """The sections in a YAML file.

    Raises:
        ValueError: as `read_settings`.
    """
    if not path.exists():
        raise ValueError(f"There is no {path} in {Path.cwd()}; run the command where it is, or name it with --config.")
    try:
        config = yaml.safe_load(path.read_text(encoding="utf-8"))
    except yaml.YAMLError as error:
        raise ValueError(f"{path} is not valid YAML: {error}") from None
    if not isinstance(config, dict):
        raise ValueError(f"{path}: expected sections such as physics and data; found {type(config).__name__}.")
    return config


def lay_over(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Two configurations as one: mappings are joined, everything else is taken from above."""
    both = {k: lay_over(below[k], above[k]) for k in below.keys() & above.keys() if _mappings(below[k], above[k])}
    return {**below, **above, **both}


def _mappings(*values: object) -> bool:
    return all(isinstance(value, Mapping) for value in values)
