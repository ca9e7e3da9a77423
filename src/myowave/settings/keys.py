"""What a tree of pydantic models says about its keys: the table for people, and error messages made from it.

It knows nothing of the settings themselves, so it can be read and tested on its own.
"""

import difflib
import textwrap
import types
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from myowave.settings.section import without_secrets

# Names for the types of values, in messages and in the table.
_TYPES = {float: "a number", int: "a whole number", str: "text", bool: "true or false"}
_MANY = {"a number": "numbers", "a whole number": "whole numbers", "text": "texts"}
_BOUNDS = {"ge": "at least {:g}", "gt": "above {:g}", "le": "at most {:g}", "lt": "below {:g}"}


@dataclass(frozen=True)
class Key:
    """One key of the configuration.

    Args:
        path: as pydantic names it; `<name>` stands for a key that the user chooses, `:tag` for a member of a union.
        allowed: what values it takes, in words.
        default: None where the key must be given.
    """

    path: tuple[str, ...]
    unit: str
    allowed: str
    default: str | None
    meaning: str

    @property
    def name(self) -> str:
        return ".".join(part for part in self.path if not part.startswith(":"))


def list_keys(model: type[BaseModel], path: tuple[str, ...] = ()) -> Iterator[Key]:
    """All keys below a model, in the order they are written down; a section comes before what it holds."""
    for name, field in model.model_fields.items():
        here = (*path, name)
        extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
        yield Key(here, str(extra.get("unit", "")), _allowed(field), _default(field), field.description or "")
        yield from _keys_inside(field.annotation, here, str(extra.get("each", "name")))


def explain(error: ValidationError, keys: Sequence[Key]) -> list[str]:
    """Each problem as one line: key, value found, what is allowed."""
    return [_explain_one(problem, keys) for problem in error.errors()]


def in_words(bounds: Mapping[str, float]) -> list[str]:
    """Bounds as pydantic calls them, each in words."""
    return [_BOUNDS[name].format(limit) for name, limit in bounds.items()]


def did_you_mean(word: str, known: Sequence[str]) -> str:
    """`; did you mean 'x'?` where a known word is close, else nothing."""
    close = difflib.get_close_matches(str(word), known, n=1)
    return f"; did you mean {close[0]!r}?" if close else ""


def _keys_inside(annotation: Any, path: tuple[str, ...], each: str) -> Iterator[Key]:
    """Keys of the models found in an annotation: itself, values of a mapping, members of a union."""
    if get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield from list_keys(annotation, path)
    elif get_origin(annotation) in (dict, Mapping):
        yield from _keys_inside(get_args(annotation)[1], (*path, f"<{each}>"), each)
    elif get_origin(annotation) in (Union, types.UnionType):
        sections = [m for m in get_args(annotation) if isinstance(m, type) and issubclass(m, BaseModel)]
        for member in sections:
            yield from list_keys(member, (*path, f":{_tag(member)}") if len(sections) > 1 else path)


def _tag(member: type[BaseModel]) -> str:
    """Value of the `kind` field that tells a member of a union from the others."""
    return str(get_args(member.model_fields["kind"].annotation)[0])


def _allowed(field: FieldInfo) -> str:
    bounds = []
    for item in field.metadata:
        bounds += in_words({b: getattr(item, b) for b in _BOUNDS if getattr(item, b, None) is not None})
        pattern = getattr(item, "pattern", None)
        bounds += [f"matching {pattern}"] if pattern else []
        length = getattr(item, "min_length", None)
        bounds += ["not empty"] if length else []
    return ", ".join([_type_name(field.annotation), *bounds])


def _type_name(annotation: Any) -> str:
    origin, args = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _type_name(args[0])
    if origin is Literal:
        return " or ".join(str(value) for value in args)
    if origin in (Union, types.UnionType):
        sections = [a for a in args if isinstance(a, type) and issubclass(a, BaseModel)]
        if len(sections) > 1:
            kinds = "a section with kind: " + " or ".join(_tag(a) for a in sections)
            return kinds if len(sections) == len(args) else f"{kinds}, or null"
        return " or ".join("null" if a is type(None) else _type_name(a) for a in args)
    if origin is tuple:
        item = _type_name(args[0])
        return f"a list of {_MANY.get(item, item)}"
    if origin in (dict, Mapping):
        return f"a section of name: {_type_name(args[1])}"
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return "a section"
    return _TYPES.get(annotation, str(annotation))


def _default(field: FieldInfo) -> str | None:
    value = field.get_default(call_default_factory=True)
    if value is PydanticUndefined:
        return None
    if isinstance(value, BaseModel):
        return ""
    if isinstance(value, Mapping):
        return "{" + ", ".join(str(key) for key in value) + "}"
    if isinstance(value, tuple):
        value = list(value)
    return "null" if value is None else str(value)


def _explain_one(problem: Mapping[str, Any], keys: Sequence[Key]) -> str:
    location = tuple(str(part) for part in problem["loc"])
    if not location:  # a check across keys: its message says where
        return problem["msg"].removeprefix("Value error, ")
    shown = ".".join(_without_tags(location, keys))
    if problem["type"] == "extra_forbidden":
        siblings = _children(location[:-1], keys)
        return f"{shown}: unknown key{did_you_mean(location[-1], siblings) or '.'} Known here: {', '.join(siblings)}."
    if problem["type"] == "missing":
        key = _find(location, keys)
        return f"{shown}: is missing; give {_expected(key)}." if key else f"{shown}: is missing."
    if problem["type"].startswith("union_tag"):
        tags = [tag.removeprefix(":") for tag in _children(location, keys)]
        return f"{shown}.kind = {problem['input'].get('kind')!r}: expected {' or '.join(dict.fromkeys(tags))}."
    if problem["type"] == "value_error" and isinstance(problem["input"], Mapping):
        return f"{shown}: {problem['msg'].removeprefix('Value error, ')}"
    if problem["type"] == "value_error":
        return f"{shown} = {_short(problem['input'])}: {problem['msg'].removeprefix('Value error, ')}"
    key = _find(location, keys)
    expected = _expected(key) if key else problem["msg"]
    return f"{shown} = {_short(problem['input'])}: expected {expected}."


def _short(value: Any) -> str:
    return textwrap.shorten(without_secrets(repr(value)), 80, placeholder=" ...")


def _expected(key: Key) -> str:
    unit = f" [{key.unit}]" if key.unit else ""
    return f"{key.allowed}{unit} ({key.meaning})" if key.meaning else f"{key.allowed}{unit}"


def _matches(part: str, pattern: str) -> bool:
    return pattern.startswith("<") or part == pattern.removeprefix(":")


def _find(location: tuple[str, ...], keys: Sequence[Key]) -> Key | None:
    """The key with the longest path that the location begins with; items of lists belong to their list."""
    found = [k for k in keys if len(k.path) <= len(location) and all(map(_matches, location, k.path))]
    return max(found, key=lambda k: len(k.path), default=None)


def _children(location: tuple[str, ...], keys: Sequence[Key]) -> list[str]:
    depth = len(location)
    inside = [k for k in keys if len(k.path) > depth and all(map(_matches, location, k.path))]
    return list(dict.fromkeys(k.path[depth] for k in inside))


def _without_tags(location: tuple[str, ...], keys: Sequence[Key]) -> list[str]:
    """The location as the user wrote it: pydantic puts the tag of a union's member in."""
    tags = {
        depth
        for key in keys
        for depth, pattern in enumerate(key.path[: len(location)])
        if pattern.startswith(":") and all(map(_matches, location[: depth + 1], key.path))
    }
    return [part for depth, part in enumerate(location) if depth not in tags]
