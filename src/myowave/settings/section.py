"""What all sections of the configuration are made of: frozen models, and types that YAML cannot surprise."""

import os
import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

NAME, NOT_A_NAME = r"[A-Za-z][A-Za-z0-9_]*", "expected letters, digits and _, a letter first"
# No trial is called by what figures read as formulas, the workflow as placeholders, a file system as folders, patterns.
PLAIN = r"(?=.*\S)[^$\\{}*?\[\]/\x00-\x1f]*"
NOT_PLAIN = "a name may not be empty or hold $ \\ { } * ? [ ] / or a control sign; rename the trial"
_NO_PATH = "a path may not be empty or hold braces, which would be placeholders; rename what is called so"


def _refuse_bool(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("expected a number; YAML reads yes, no, on and off as true or false")
    return value


def matching(pattern: str, otherwise: str) -> AfterValidator:
    """Refuses a text that does not match all of a pattern, and says `otherwise`."""

    def check(text: str) -> str:
        if not re.fullmatch(pattern, text):
            raise ValueError(otherwise)
        return text

    return AfterValidator(check)


def without_secrets(text: str) -> str:
    """A text with all masked that addresses in it hold but scheme, host, port and path without parameters (`;key=`): a
    user may be a token, too.

    Rather too much is masked than too little, also of `url: /path`, as libraries tell addresses. An address within a
    page, after `#/`, stays.
    """
    text = re.sub(r"(?s)://.*@", "://***@", text)
    return re.sub(r"((?:://|url: /)[^\s?#;]*)(?:\?|;(?=\S)|#(?!/))\S*", r"\1?***", text)


def _without_secret(address: Any) -> Any:
    if isinstance(address, str) and without_secrets(address) != address:
        raise ValueError(
            "an address may not hold a user, password or key, which would stand in logs, pages and records of jobs. "
            "Take it out; for a tracking server it belongs in MLFLOW_TRACKING_USERNAME and MLFLOW_TRACKING_PASSWORD"
        )
    return address


def _each_once(values: Sequence[Any]) -> Sequence[Any]:
    if repeated := sorted({str(value) for value in values if values.count(value) > 1}):
        raise ValueError(f"{', '.join(repeated)} is there more than once; keep one of each")
    return values


def _no_folder(path: str) -> str:
    if os.path.isdir(path):
        raise ValueError("this is a folder; expected a file. Name one in it")
    return path


Real = Annotated[float, BeforeValidator(_refuse_bool)]
Whole = Annotated[int, BeforeValidator(_refuse_bool)]
TrialName = Annotated[str, Field(coerce_numbers_to_str=True), matching(PLAIN, NOT_PLAIN)]  # YAML reads 1 as a number
FilePath = Annotated[str, matching(r"(?=.*\S)[^{}\n\0]*", _NO_PATH)]
OneFile = Annotated[FilePath, AfterValidator(_no_folder)]
Address = Annotated[str, BeforeValidator(_without_secret)]
Once = AfterValidator(_each_once)  # of a list
Name = Annotated[str, matching(NAME, NOT_A_NAME)]
_EffectsOnce = AfterValidator(lambda model: "+".join(_each_once(model.split("+"))))
ModelName = Annotated[str, Field(pattern=r"^base(\+[A-Za-z_][A-Za-z0-9_]*)*$"), _EffectsOnce]


# Of a mapping, which loses keys that are null: a file laid over another can only replace keys.
WithoutNull = BeforeValidator(
    lambda value: {k: v for k, v in value.items() if v is not None} if isinstance(value, Mapping) else value
)


def setting(meaning: str, unit: str = "", default: Any = ..., *, each: str = "name", **bounds: Any) -> Any:
    """A key of the configuration; `each` names what the keys of a mapping stand for.

    Bounds are those of pydantic's Field. They are also written into the schema, from which people are told of them.
    """
    source = {"default_factory": default} if callable(default) else {"default": default}
    numbers = {name: limit for name, limit in bounds.items() if name in ("ge", "gt", "le", "lt")}
    extra: dict[str, Any] = {"unit": unit, "each": each, "bounds": numbers}
    return Field(**source, description=meaning, json_schema_extra=extra, **bounds)


class Section(BaseModel):
    """Frozen, and refuses keys it does not know."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def dump(section: Section) -> dict[str, Any]:
    """A section as plain data, defaults filled in: what a rule is given, and what its result depends on."""
    return section.model_dump(mode="json")
