"""Settings from YAML files: outside of the workflow, and before Snakemake reads them."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from myowave.settings.configuration import Settings
from myowave.settings.layers import lay_over, read_yaml
from myowave.settings.parsing import parse_settings
from myowave.settings.subjects import add_subjects

_SECTIONS = "physics and data"


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
        config = lay_over(config, _read(path, "--config"))
    return config


def check_command_line(arguments: Sequence[str] | None = None) -> None:
    """End a command of Snakemake with one message where a configuration file cannot be read.

    The profiles call it: Snakemake itself would show a traceback, not say which line of which file is wrong, and take
    the last of two equal keys in silence.

    Args:
        arguments: of the command; None takes those of this process.
    """
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--configfile", "--configfiles", nargs="+", type=Path, default=[])
    found, _ = parser.parse_known_args(arguments)
    own = Path("config.yaml")
    try:
        for path in dict.fromkeys([*found.configfile, *([own] if own.exists() else [])]):
            _read(path, "--configfile")
    except ValueError as error:
        sys.exit(f"The configuration has problems; nothing was run.\n{error}")


def _read(path: Path, option: str) -> dict[str, Any]:
    if not path.exists():
        raise ValueError(f"There is no {path} in {Path.cwd()}; run the command where it is, or name it with {option}.")
    return read_yaml(path, _SECTIONS)
