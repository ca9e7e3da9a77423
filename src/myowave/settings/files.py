"""YAML files as plain data, one laid over another; nothing is checked here but that they can be read."""

import argparse
import sys
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import yaml
from yaml.nodes import CollectionNode, MappingNode, Node, ScalarNode

LARGEST_BYTES = 1e9
"""Of a file that is read whole: an hour of 16 channels at 1 kHz as text is half of it, and takes some GB of memory."""
LARGEST = 200_000  # values in a file with its aliases written out; the configuration that ships has a thousand


class _Loader(yaml.SafeLoader):  # type: ignore[misc]
    """Refuses a key that is there twice, of which YAML would keep the last in silence, one that a missing space joins
    with its value, and aliases that become huge."""

    def get_single_node(self) -> Node | None:
        node = super().get_single_node()
        if node is not None and _size(node, {}) > LARGEST:
            problem = "aliases within aliases make it huge; write out what you mean"
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=node.start_mark)
        return node

    def compose_mapping_node(self, anchor: Any) -> MappingNode:
        node = super().compose_mapping_node(anchor)
        first: dict[str, ScalarNode] = {}
        for key, value in node.value:
            alone = node.flow_style and isinstance(value, ScalarNode) and not value.value and not value.style
            if alone and isinstance(key, ScalarNode) and not key.style and ":" in key.value:  # {mass:1.4}
                apart = ": ".join(key.value.split(":", 1))
                problem = f"{key.value} needs a space behind the colon, {apart}"
                raise yaml.MarkedYAMLError(problem=problem, problem_mark=key.start_mark)
            if isinstance(key, ScalarNode) and first.setdefault(key.value, key) is not key:
                again = f"the key {key.value} is there already, {_at(first[key.value].start_mark)}"
                raise yaml.MarkedYAMLError(problem=f"{again}; join them, or remove one", problem_mark=key.start_mark)
        return node


def require_regular(path: Path) -> None:
    """Raise a ValueError for a link to nothing, a pipe or a device, which may never end, and a huge file."""
    if path.is_symlink() and not path.exists():
        raise ValueError(f"{path}: a link to {path.readlink()}, which is not there. Put it there, or remove the link.")
    if path.exists() and not path.is_file() and not path.is_dir():
        raise ValueError(f"{path}: this is a pipe or a device; expected a file. Write what it gives into one.")
    if path.is_file() and (size := path.stat().st_size) > LARGEST_BYTES:
        most = f"{LARGEST_BYTES / 1e9:.2g} GB"
        raise ValueError(f"{path}: {size / 1e9:.2g} GB; expected at most {most}. Split or thin it.")


def read_yaml(path: Path, such_as: str = "physics and data") -> dict[str, Any]:
    """The sections in a YAML file, `such_as` these. A ValueError for a file that cannot be read, is not YAML, or holds
    no sections or a key twice."""
    require_regular(path)
    try:
        values = yaml.load(path.read_text(encoding="utf-8-sig"), _Loader)
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: this is not UTF-8 text ({error.reason}). Save it as text, UTF-8.") from None
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}. Name a YAML file.") from None
    except yaml.MarkedYAMLError as error:
        raise ValueError(f"{path} is not valid YAML, {_at(error.problem_mark)}: {error.problem}. Correct it.") from None
    except (yaml.YAMLError, ValueError) as error:
        raise ValueError(f"{path} is not valid YAML: {' '.join(str(error).split())}") from None
    except RecursionError:
        raise ValueError(f"{path}: sections within sections without end; expected a few levels.") from None
    if not isinstance(values, dict):
        found = "nothing" if values is None else type(values).__name__
        raise ValueError(f"{path}: expected sections such as {such_as}; found {found}.")
    return values


def lay_over(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Two configurations as one: mappings are joined, everything else is taken from above."""
    both = [k for k in below.keys() & above.keys() if isinstance(below[k], Mapping) and isinstance(above[k], Mapping)]
    return {**below, **above} | {k: lay_over(below[k], above[k]) for k in both}


def read_layers(paths: Iterable[Path], option: str = "--config") -> dict[str, Any]:
    """YAML files, each laid over those before, as after Snakemake's --configfile. A ValueError for a file that is not
    there, which a command names by `option`, or is not YAML."""
    config: dict[str, Any] = {}
    for path in paths:
        if not path.exists():
            raise ValueError(
                f"There is no {path} in {Path.cwd()}; run the command where it is, or name it with {option}."
            )
        config = lay_over(config, read_yaml(path))
    return config


def check_command_line(arguments: Sequence[str] | None = None) -> None:
    """End a command of Snakemake with one message where a configuration file cannot be read.

    The profiles call it: Snakemake itself would show a traceback, not say which line of which file is wrong, and take
    the last of two equal keys in silence. Its arguments are those of this process where none are given.
    """
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--configfile", "--configfiles", nargs="+", type=Path, default=[])
    named = parser.parse_known_args(arguments)[0].configfile
    own = [path for path in (Path("config.yaml"),) if path.exists()]
    try:
        read_layers(dict.fromkeys([*named, *own]), "--configfile")
    except ValueError as error:
        sys.exit(f"The configuration has problems; nothing was run.\n{error}")


def _size(node: Node, known: dict[Node, float]) -> float:
    """Values at and below a node, those of an alias counted wherever it stands; infinite where one holds itself."""
    if node not in known:
        known[node] = float("inf")
        children = node.value if isinstance(node, CollectionNode) else ()
        flat = chain.from_iterable(children) if isinstance(node, MappingNode) else children
        known[node] = 1 + sum(_size(child, known) for child in flat)
    return known[node]


def _at(mark: Any) -> str:
    return f"line {mark.line + 1}, column {mark.column + 1}" if mark else "somewhere"
