"""Settings from YAML files, outside of the workflow, where Snakemake reads them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from myowave.settings.configuration import Settings
from myowave.settings.layers import lay_over, read_yaml
from myowave.settings.parsing import parse_settings
from myowave.settings.subjects import add_subjects


def read_settings(paths: Sequence[Path]) -> Settings:
    """The settings in YAML files, each laid over those before, as after Snakemake's --configfile.

    Raises:
        ValueError: for a file that is not there, is not YAML, or has wrong keys.
    """
    return parse_settings(add_subjects(read_layers(paths)))


def read_layers(paths: Sequence[Path]) -> dict[str, Any]:
    """The same as plain data, nothing checked.

    Raises:
        ValueError: for a file that is not there or is not YAML.
    """
    config: dict[str, Any] = {}
    for path in paths:
        if not path.exists():
            raise ValueError(
                f"There is no {path} in {Path.cwd()}; run the command where it is, or name it with --config."
            )
        config = lay_over(config, read_yaml(path, "physics and data"))
    return config
