"""YAML files as plain data, and one laid over another."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml
from yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

LARGEST = 200_000  # values in a file with its aliases written out; the configuration that ships has a thousand


def read_yaml(path: Path, such_as: str) -> dict[str, Any]:
    """The sections in a YAML file.

    Args:
        such_as: sections that are expected in it, for the message.

    Raises:
        ValueError: for a file that cannot be read, is not YAML, holds no sections or a key twice, or becomes huge where
            its aliases are written out.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: this is not UTF-8 text ({error.reason}). Save it as text, UTF-8.") from None
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}. Name a YAML file.") from None
    try:
        values = _load(text)
    except yaml.MarkedYAMLError as error:
        raise ValueError(f"{path} is not valid YAML, {_at(error.problem_mark)}: {error.problem}. Correct it.") from None
    except yaml.YAMLError as error:
        raise ValueError(f"{path} is not valid YAML: {' '.join(str(error).split())}") from None
    except RecursionError:
        raise ValueError(f"{path}: sections within sections without end; expected a few levels.") from None
    except ValueError as error:
        raise ValueError(f"{path}, {error}") from None
    if not isinstance(values, dict):
        found = "nothing" if values is None else type(values).__name__
        raise ValueError(f"{path}: expected sections such as {such_as}; found {found}.")
    return values


def lay_over(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Two configurations as one: mappings are joined, everything else is taken from above."""
    both = {k: lay_over(below[k], above[k]) for k in below.keys() & above.keys() if _mappings(below[k], above[k])}
    return {**below, **above, **both}


def _mappings(*values: object) -> bool:
    return all(isinstance(value, Mapping) for value in values)


def _load(text: str) -> Any:
    loader = yaml.SafeLoader(text)
    try:
        node = loader.get_single_node()
        if node is None:
            return None
        _refuse_repeated_keys(node, set())
        if _size(node, {}) > LARGEST:
            raise ValueError(f"{_at(node.start_mark)}: aliases within aliases make it huge; write out what you mean.")
        return loader.construct_document(node)
    finally:
        loader.dispose()


def _refuse_repeated_keys(node: Node, seen: set[Node]) -> None:
    if node in seen:
        return
    seen.add(node)
    first: dict[str, ScalarNode] = {}
    for key, _ in node.value if isinstance(node, MappingNode) else ():
        if isinstance(key, ScalarNode) and first.setdefault(key.value, key) is not key:
            there = _at(first[key.value].start_mark)
            raise ValueError(
                f"{_at(key.start_mark)}: the key {key.value} is there already, {there}; YAML keeps only the last one. "
                "Join them, or remove one."
            )
    for child in _children(node):
        _refuse_repeated_keys(child, seen)


def _size(node: Node, known: dict[Node, float]) -> float:
    """Values at and below a node, those of an alias counted wherever it stands; infinite where one holds itself."""
    if node not in known:
        known[node] = float("inf")
        known[node] = 1 + sum(_size(child, known) for child in _children(node))
    return known[node]


def _children(node: Node) -> Iterator[Node]:
    if isinstance(node, SequenceNode):
        yield from node.value
    elif isinstance(node, MappingNode):
        for key, value in node.value:
            yield key
            yield value


def _at(mark: Any) -> str:
    return f"line {mark.line + 1}, column {mark.column + 1}" if mark else "somewhere"
