"""What a pydantic model says about its keys: the table for people, and error messages made from it.

Both read the JSON schema that pydantic makes. Nothing here knows the settings themselves.
"""

import difflib
import json
import textwrap
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from pydantic import BaseModel, ValidationError

from myowave.settings.section import without_secrets

Schema = Mapping[str, Any]  # of a key, with all that stands below it

TO_FILL_IN = "FILL IN"  # what `myowave new` writes where only a person knows

# Names for the types of values, in messages and in the table.
_TYPES = {
    "number": "a number",
    "integer": "a whole number",
    "string": "text",
    "boolean": "true or false",
    "null": "null",
}
_MANY = {"number": "numbers", "integer": "whole numbers", "string": "texts"}
_BOUNDS = {"ge": "at least", "gt": "above", "le": "at most", "lt": "below"}  # as pydantic calls them


@dataclass(frozen=True)
class Key:
    """One key of the configuration."""

    name: str  # from the top, with dots; `<name>` stands for a key that the user chooses
    unit: str
    allowed: str  # what values it takes, in words
    default: str | None  # None where the key must be given, empty for a section
    meaning: str
    section: bool  # whether it holds keys

    @property
    def group(self) -> str:
        """What it is listed under: the section that the first two parts of its name are, else the first part."""
        parts = self.name.split(".")
        return ".".join(parts[:2]) if self.section or len(parts) > 2 else parts[0]

    @property
    def facts(self) -> str:
        """Unit and default."""
        default = "required" if self.default is None else f"default {self.default}" if self.default else ""
        return "  ".join(fact for fact in (self.unit and f"[{self.unit}]", default) if fact)


# ---- the table


def list_keys(model: type[BaseModel]) -> list[Key]:
    """All keys below a model, in the order they are written down; a section comes before what it holds."""
    return list(dict.fromkeys(_keys_inside(_schema_of(model), "", "")))


def list_groups(keys: Sequence[Key]) -> dict[str, tuple[int, str]]:
    """{group: (number of its keys, meaning)} in the order of config.yaml."""
    counts = Counter({key.name: key.group for key in keys if not key.section}.values())
    return {key.name: (counts[key.name], key.meaning) for key in keys if key.name in counts}


def find_keys(keys: Sequence[Key], words: Sequence[str]) -> list[Key]:
    """Keys of a group, or those with all of the words in name, unit or meaning; all where there is no word. A
    ValueError where nothing is found."""
    asked = " ".join(words)
    group = [key for key in keys if asked == key.name or key.name.startswith(f"{asked}.")]
    wanted = [word.lower() for word in words]
    found = group or [k for k in keys if all(word in f"{k.name} {k.unit} {k.meaning}".lower() for word in wanted)]
    if not found:
        parts = sorted({part for key in keys for part in key.name.split(".") if part.isidentifier()})
        raise ValueError(f"No setting has {asked!r} in its name or meaning{did_you_mean(asked, parts) or '.'}")
    return found


def _keys_inside(node: Schema, path: str, each: str) -> Iterator[Key]:
    """Keys of the sections that may stand at a place: itself, values of a mapping, members of a union."""
    for section in _alternatives(node):
        for name, field in section.get("properties", {}).items():
            default = None if name in section.get("required", ()) else _default(field)
            here = f"{path}.{name}".removeprefix(".")
            inside = list(_keys_inside(field, here, field.get("each", "name")))
            about = field.get("description", "")
            yield Key(here, field.get("unit", ""), _allowed(field), default, about, section=bool(inside))
            yield from inside
        if values := _values(section):
            yield from _keys_inside(values, f"{path}.<{each}>", each)


def _default(field: Schema) -> str:
    if "default" not in field:
        return "{}" if any(map(_values, _alternatives(field))) else ""
    value = field["default"]
    return value if isinstance(value, str) else json.dumps(value)


# ---- messages


def explain(error: ValidationError, model: type[BaseModel]) -> list[str]:
    """Each problem of a model's values as one line: key, value found, what is allowed."""
    return [_explain_one(problem, _schema_of(model)) for problem in error.errors()]


def in_words(bounds: Mapping[str, float]) -> list[str]:
    """Bounds as pydantic calls them, each in words."""
    return [f"{_BOUNDS[name]} {limit:g}" for name, limit in bounds.items()]


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """`; did you mean 'x'?` where a known word is close, else nothing."""
    in_small = {name.lower(): name for name in known}
    close = difflib.get_close_matches(word.lower(), in_small, n=1)
    return f"; did you mean {in_small[close[0]]!r}?" if close else ""


def unless_known(path: str, name: str, known: Collection[str], whose: str = "", more: str = "") -> list[str]:
    """No problem, or one: what is at `path` is not among the known names, of which `whose` says more."""
    if name in known:
        return []
    names = sorted(known)
    return [
        f"{path}: there is no {name!r}{whose}{did_you_mean(name, names) or '.'} Known: {', '.join(names) or 'none'}."
        + more
    ]


def _explain_one(problem: Mapping[str, Any], root: Schema) -> str:
    kind, said, value = problem["type"], problem["msg"].removeprefix("Value error, "), problem["input"]
    if not problem["loc"]:  # a check across keys: its message says where
        return said
    path, nodes = _follow([str(part) for part in problem["loc"]], root)
    shown = ".".join(path)
    if kind == "extra_forbidden":
        siblings = [name for section in _alternatives(nodes[-2]) for name in section.get("properties", ())]
        return f"{shown}: unknown key{did_you_mean(path[-1], siblings) or '.'} Known here: {', '.join(siblings)}."
    if kind == "missing":
        return f"{shown}: is missing; give {_expected(nodes)}."
    if kind.startswith("union_tag"):
        union = nodes[-1]["discriminator"]
        name = union["propertyName"]
        return f"{shown}.{name} = {value.get(name)!r}: expected {' or '.join(union['mapping'])}."
    if value == TO_FILL_IN:
        return f"{shown}: is still to fill in; give {_expected(nodes)}."
    if kind == "invalid_key" or (path[-1] == "[key]" and kind != "value_error"):  # {mass_kg: 1,4} has a key 4
        return f"{shown} = {_short(value)}: {said}; a name is text, and decimals need a point."
    found = "" if kind == "value_error" and isinstance(value, Mapping) else f" = {_short(value)}"
    return f"{shown}{found}: {said if kind == 'value_error' else f'expected {_expected(nodes)}.'}"


def _short(value: Any) -> str:
    return textwrap.shorten(without_secrets(repr(value)), 80, placeholder=" ...")


def _expected(nodes: Sequence[Schema]) -> str:
    """What is allowed at the last of some nodes; unit and meaning are those of the key that it belongs to."""
    key = next((node for node in reversed(nodes) if node.get("description") and "unit" in node), {})
    place = next(node for node in reversed(nodes) if node)
    unit = f" [{key['unit']}]" if key.get("unit") else ""
    return _allowed(place) + unit + (f" ({key['description']})" if key else "")


def _follow(location: Sequence[str], root: Schema) -> tuple[list[str], list[Schema]]:
    """The location as the user wrote it, without tags of unions that pydantic puts in, and the nodes passed."""
    path: list[str] = []
    nodes = [root]
    for part in location:
        if part in (tags := nodes[-1].get("discriminator", {}).get("mapping", {})):
            nodes.append(tags[part])
        else:
            path.append(part)
            nodes.append(next((_below(section, part) for section in _alternatives(nodes[-1])), {}))
    return path, nodes


# ---- the schema


@cache
def _schema_of(model: type[BaseModel]) -> Schema:
    """The JSON schema of a model, with the definition of each section put where the schema refers to it."""
    schema = model.model_json_schema()

    def whole(part: Any) -> Any:
        if isinstance(part, str) and part.startswith("#/$defs/"):
            return whole(schema["$defs"][part.rpartition("/")[2]])
        if isinstance(part, list):
            return [whole(item) for item in part]
        if not isinstance(part, dict):
            return part
        inside = {name: whole(item) for name, item in part.items() if name != "$defs"}
        return {**inside.pop("$ref", {}), **inside}  # what the reference says of unit and meaning counts more

    return whole(schema)


def _alternatives(node: Schema) -> list[Schema]:
    """What may stand at a place, but null."""
    options = node.get("oneOf") or node.get("anyOf") or [node]
    return [option for option in options if option.get("type") != "null"]


def _values(section: Schema) -> Schema:
    """The node of the values of a mapping whose keys the user chooses; empty where it is none."""
    named: Any = section.get("additionalProperties")
    return named if isinstance(named, Mapping) else {}


def _below(section: Schema, part: str) -> Schema:
    """The node of a key, of a value of a mapping, or of an item of a list; empty where there is none."""
    return section.get("properties", {}).get(part) or _values(section) or section.get("items", {})


def _allowed(node: Schema) -> str:
    """What values a node takes, in words."""
    bounds = in_words(node.get("bounds", {}))
    if "pattern" in node:
        bounds.append(f"matching {node['pattern']}")
    if "minLength" in node or "minProperties" in node or ("minItems" in node and "items" in node):
        bounds.append("not empty")
    return ", ".join([_kind(node), *bounds])


def _kind(node: Schema) -> str:
    if union := node.get("discriminator"):
        return f"a section with {union['propertyName']}: {' or '.join(union['mapping'])}"
    if "anyOf" in node:
        return " or ".join(map(_kind, node["anyOf"]))
    if "const" in node or "enum" in node:
        return " or ".join(str(value) for value in node.get("enum", [node.get("const")]))
    if node["type"] == "array":
        item = node.get("items") or node["prefixItems"][0]
        return f"a list of {_MANY.get(item.get('type', ''), _allowed(item))}"
    if node["type"] == "object":
        return f"a section of name: {_allowed(values)}" if (values := _values(node)) else "a section"
    return _TYPES[node["type"]]
