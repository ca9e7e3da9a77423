"""Users' own effect files: Python files with one or more `Effect` objects at module level."""

import importlib.util
import sys
import traceback
from pathlib import Path

from myowave.physics.effect import Effect
from myowave.physics.effect_check import check_effect


def load_effects(path: str | Path) -> list[Effect]:
    """The effects of a user's file, each tried on a small elbow.

    Raises:
        ValueError: if the file is missing, raises, has no effect, or has one that fails `check_effect`.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path}: no such effect file; correct physics.effect_files in the configuration")
    found = [value for value in _run(path).values() if isinstance(value, Effect)]
    effects = list({id(effect): effect for effect in found}.values())
    if not effects:
        raise ValueError(
            f"{path}: holds no Effect; expected at least one at module level, such as EFFECT = Effect(name=..., ...)"
        )
    for effect in effects:
        try:
            check_effect(effect)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from error
    return effects


def _run(path: Path) -> dict[str, object]:
    """Run a file as a module and return its names."""
    name = f"myowave_effect_file_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ValueError(f"{path}: an effect file is Python code; give it a name that ends in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up there
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # a file that ends the program would end it in silence
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
        line = lines[-1] if lines else getattr(error, "lineno", None)
        at = f", line {line}" if line else ""
        found = f"{type(error).__name__}: {error}".removesuffix(": ")
        raise ValueError(f"{path}{at}: reading the effect file raised {found}. Correct the file there.") from error
    return vars(module)
