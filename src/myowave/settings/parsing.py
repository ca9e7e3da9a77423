"""From parsed YAML to settings, or to a message with a line for each problem."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from myowave.settings.configuration import Settings, unless_known
from myowave.settings.data import MeasuredDataset, RecordedDataset, SimulatedDataset
from myowave.settings.keys import explain, list_keys
from myowave.settings.learning import Recipe
from myowave.settings.section import Section

KEYS = tuple(list_keys(Settings))


def parse_settings(config: Mapping[str, Any]) -> Settings:
    """Check a parsed config.yaml.

    Raises:
        ValueError: one line a problem, each with the key, what was found and what is allowed.
    """
    return _parse(Settings, config, ())


def parse_section(path: str, values: Mapping[str, Any]) -> Any:
    """The settings object for one part of the configuration, such as `physics` or `learning.recipes.rollout`.

    Args:
        path: dotted path of the part.
        values: the part, as `dump` gives it.
    """
    parts = tuple(path.split("."))
    kinds = {1: _SECTIONS, 3: {"datasets": MeasuredDataset, "recipes": Recipe}}[len(parts)]
    kind = kinds[parts[0] if len(parts) == 1 else parts[1]]
    if kind is MeasuredDataset:
        kind = {"simulated": SimulatedDataset, "recorded": RecordedDataset}.get(values.get("kind"), kind)
    return _parse(kind, values, parts)


def check_effects(settings: Settings) -> None:
    """Whether the effects that the settings name are there, told from file names: loading the physics takes a second.

    With effect files of the user's own, whose names are known only once they are loaded, a job finds out instead.

    Raises:
        ValueError: one line for each effect that is not there.
    """
    if settings.physics.effect_files:
        return
    folder = Path(__file__).parents[1] / "physics" / "effects"
    known = [path.stem for path in folder.glob("[!_]*.py")]
    named = [
        (f"targets.models.{dataset}", effect)
        for dataset, models in settings.targets.models.items()
        for model in models
        for effect in model.split("+")[1:]
    ]
    for name, dataset in settings.data.datasets.items():
        named += [(f"data.datasets.{name}.hidden_effect", effect) for effect in getattr(dataset, "hidden_effect", ())]
    if problems := [line for path, effect in named for line in unless_known(path, effect, known)]:
        raise ValueError("\n".join(problems))


_SECTIONS = {name: field.annotation for name, field in Settings.model_fields.items()}


def _parse(kind: type[Section], values: Mapping[str, Any], path: tuple[str, ...]) -> Any:
    try:
        return kind.model_validate(values)
    except ValidationError as error:
        lines = explain(error, KEYS if not path else tuple(list_keys(kind)))
        prefix = ".".join(path) + "." if path else ""
        raise ValueError("\n".join(prefix + line for line in lines)) from None
