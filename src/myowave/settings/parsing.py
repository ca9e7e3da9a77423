"""From parsed YAML to settings, or to a message with a line for each problem."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from myowave.settings.configuration import Settings, unless_known
from myowave.settings.files import read_layers
from myowave.settings.keys import explain
from myowave.settings.subjects import add_subjects


def parse_settings(config: Mapping[str, Any]) -> Settings:
    """Check a parsed config.yaml.

    Raises:
        ValueError: one line per problem, each with the key, what was found and what is allowed.
    """
    try:
        return Settings.model_validate(config)
    except ValidationError as error:
        raise ValueError("\n".join(explain(error, Settings))) from None


def read_settings(paths: Sequence[Path]) -> Settings:
    """The settings in YAML files, each laid over those before.

    Raises:
        ValueError: for a file that is not there, is not YAML, or has wrong keys.
    """
    return parse_settings(add_subjects(read_layers(paths)))


def shipped_effects() -> list[str]:
    """Names of the effects that ship, told from file names: loading the physics takes a second."""
    folder = Path(__file__).parents[1] / "physics" / "effects"
    return sorted(path.stem for path in folder.glob("[!_]*.py"))


def check_effects(settings: Settings) -> None:
    """Whether the effects that the settings name are there.

    With effect files of the user's own, whose names are known only once they are loaded, a job finds out instead.

    Raises:
        ValueError: one line for each effect that is not there.
    """
    if settings.physics.effect_files:
        return
    named = [
        (f"targets.models.{dataset}", effect)
        for dataset, models in settings.targets.models.items()
        for model in models
        for effect in model.split("+")[1:]
    ]
    for name, dataset in settings.data.datasets.items():
        named += [(f"data.datasets.{name}.hidden_effect", effect) for effect in getattr(dataset, "hidden_effect", ())]
    known = shipped_effects()
    if problems := [line for path, effect in named for line in unless_known(path, effect, known)]:
        raise ValueError("\n".join(problems))
