"""What all sections of the configuration are made of: frozen models, and types that YAML cannot surprise."""

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field


def _refuse_bool(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("expected a number; YAML reads yes, no, on and off as true or false")
    return value


def _name_of_trial(value: Any) -> Any:
    """Trials may be called 1, 2, ...: YAML reads those as numbers."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


Real = Annotated[float, BeforeValidator(_refuse_bool)]
Whole = Annotated[int, BeforeValidator(_refuse_bool)]
TrialName = Annotated[str, BeforeValidator(_name_of_trial)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
ModelName = Annotated[str, Field(pattern=r"^base(\+[A-Za-z_][A-Za-z0-9_]*)*$")]


def setting(meaning: str, unit: str = "", default: Any = ..., *, each: str = "name", **bounds: Any) -> Any:
    """A key of the configuration; `each` names what the keys of a mapping stand for."""
    source = {"default_factory": default} if callable(default) else {"default": default}
    return Field(**source, description=meaning, json_schema_extra={"unit": unit, "each": each}, **bounds)


class Section(BaseModel):
    """Frozen, and refuses keys it does not know."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def dump(section: Section) -> dict[str, Any]:
    """A section as plain data, defaults filled in: what a rule is given, and what its result depends on."""
    return section.model_dump(mode="json")
