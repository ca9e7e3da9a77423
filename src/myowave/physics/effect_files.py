"""Users' own effect files: Python files with one or more `Effect` objects at module level, each tried before it is
trusted: on a small elbow, over its bounds."""

import functools
import importlib.util
import itertools
import sys
import traceback
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from myowave.physics.effect import Effect
from myowave.physics.model import Model
from myowave.physics.motion import simulate
from myowave.physics.muscle import EXTENSOR, FLEXOR, Muscle
from myowave.physics.path import StraightPath
from myowave.physics.simulation import Simulation

TOLERANCE = 1e-9  # rad: how much an effect may move the angle with all parameters at 0
DT, SAMPLES = 0.01, 4
ANGLES, VELOCITIES = (-0.2, 0.9, 1.6, 2.3), (-3.0, 3.0)  # of the trials' first samples [rad, rad/s]
COPIES = 3  # leading batch axis
ALL, SOME = slice(None), slice(2, 5)  # of the trials, which move as they do among all
Number = Tensor | float
STEP, SLOPE_TOLERANCE = 1e-4, 1e-5  # of differences, and by how much of 1 and itself a derivative may be off


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
    return [_signed(effect, path) for effect in effects]


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
        found = f"{type(error).__name__}: {error}".rstrip(": .")
        raise ValueError(f"{path}{at}: reading the effect file raised {found}. Correct the file there.") from error
    return vars(module)


def trial_elbow() -> Model:
    """An elbow with a flexor and an extensor, Table 1 of Taneja et al. 2023, to try effects on."""
    shared = {"f0": 300.0, "pennation": 0.0, "delay": 0.08, "shape": 0.2}
    flexor = {**shared, "l0": 0.6, "vmax": 6.0, "slack": 0.55}
    extensor = {**shared, "l0": 0.4, "vmax": 4.0, "slack": 0.33}
    biceps = Muscle("Bi", FLEXOR, "emg_biceps", flexor, StraightPath(0.3, 0.8, FLEXOR))
    triceps = Muscle("Tri", EXTENSOR, "emg_triceps", extensor, StraightPath(0.2, 0.7, EXTENSOR))
    return Model((biceps, triceps), {"mass": 1.0, "length": 1.0, "load": 0.0, "tilt": 0.0})


def check_effect(effect: Effect) -> None:
    """Try an effect on `trial_elbow`: shapes, nothing changed at 0, finite over the bounds, trials apart, derivatives.

    Raises:
        ValueError: if the effect fails; the message says what was found, what was expected and what to do.
    """
    base = trial_elbow()
    where = f"effect {effect.name!r} on {effect.acts_on}"
    extended = base.with_effects([_watched(effect)])
    parameters = extended.parameters_of(effect)

    zero = {name: torch.zeros(COPIES, 1, dtype=torch.float64, requires_grad=True) for name in parameters}
    absent, present = _try(base, {}, where), _try(extended, zero, where)
    if present.shape != (COPIES, *absent.shape):
        raise ValueError(
            f"{where}: with parameters of shape ({COPIES}, 1) the angle has shape {tuple(present.shape)} instead of "
            f"{(COPIES, *absent.shape)}. Return one value for each trial at the joint, or one for each muscle (last "
            "axis) at a muscle's stage; sum or unsqueeze what your function returns."
        )
    moved = (present - absent).abs().max().item()
    if not moved <= TOLERANCE:
        raise ValueError(
            f"{where}: with all parameters at 0 it moves the angle by {moved:.3g} rad within {SAMPLES} samples; "
            "0 must mean no effect. Write the parameter as the departure from the model without the effect."
        )
    slopes = torch.autograd.grad(present.sum(), list(zero.values()), allow_unused=True) if present.requires_grad else ()
    if lost := [name for name, slope in zip(zero, slopes or [None] * len(zero), strict=True) if slope is None]:
        raise ValueError(
            f"{where}: what it returns has no derivative by {', '.join(lost)}; fits and networks need it. Compute with "
            "torch alone, without detach, item, numpy, float() or no_grad."
        )
    for name, slope in zip(zero, slopes, strict=True):
        if not torch.isfinite(slope).all():
            raise ValueError(
                f"{where}: the derivative by {name} at 0 is not finite; avoid roots and divisions by 0 there."
            )
    points = _corners(effect, extended)
    tried = [_try(extended, point, where) for point in points]
    again = [_try(extended, point, where, SOME) for point in reversed(points)]
    for point, angle, alone in zip(points, tried, reversed(again), strict=True):
        if not torch.isfinite(angle).all():
            values = ", ".join(f"{name} = {value:g}" for name, value in point.items())
            raise ValueError(
                f"{where}: the angle is not finite with {values}, which is within the bounds. Narrow the bounds, or "
                "guard divisions, roots and exponentials in the function."
            )
        if not torch.allclose(alone, angle[..., SOME, :], rtol=TOLERANCE, atol=TOLERANCE):
            raise ValueError(
                f"{where}: the same trial gave another angle when it was called again, without others beside it. Keep "
                "nothing between calls (no global or random number), and compute each value from those at its own "
                "place (no mean, sum, roll or flip over trials); an effect with a memory has a relaxation."
            )
    along = functools.partial(_try, extended, points[len(points) // 2], where, ALL)
    here = torch.zeros((), dtype=torch.float64, requires_grad=True)
    by_torch = torch.autograd.grad(along(here).sum(), here)[0].item()
    by_steps = ((along(STEP) - along(-STEP)).sum() / (2 * STEP)).item()
    if not abs(by_torch - by_steps) <= SLOPE_TOLERANCE * (1 + abs(by_steps)):
        raise ValueError(
            f"{where}: the derivative that torch finds is {by_torch:.6g}, small steps find {by_steps:.6g}. Compute "
            "with torch alone, without detach, item, no_grad or a backward of your own."
        )


def _wrapped(effect: Effect, wrap: Callable[[Callable[..., Any]], Callable[..., Any]]) -> Effect:
    """The effect with each of its functions wrapped."""
    optional: dict[str, Any] = {name: wrap(f) for name in ("relaxation", "initial") if (f := getattr(effect, name))}
    return replace(effect, function=wrap(effect.function), **optional)


def _signed(effect: Effect, path: Path) -> Effect:
    """The effect with functions that, where they raise in a fit, are named with the file that they are in."""

    def signed(function: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(function)
        def call(*at: Any, **given: Any) -> Any:
            try:
                return function(*at, **given)
            except torch.linalg.LinAlgError:  # type: ignore[attr-defined]  # a fit goes on without it
                raise
            except Exception as error:
                raise ValueError(
                    f"{path}: effect {effect.name!r} raised {type(error).__name__}: {error}. It has to return a value "
                    "for all angles, speeds and parameters that a fit may try; correct it, or leave the file out of "
                    "physics.effect_files."
                ) from error

        return call

    return _wrapped(effect, signed)


def _watched(effect: Effect) -> Effect:
    """The effect with functions that may not change their arguments."""

    def watched(function: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(function)
        def call(**given: Any) -> Any:
            before = {name: value.detach().clone() for name, value in given.items() if isinstance(value, Tensor)}
            result = function(**given)
            if changed := [
                n for n, value in before.items() if not torch.equal(value.nan_to_num(), given[n].detach().nan_to_num())
            ]:
                raise ValueError(
                    f"it changes {', '.join(changed)} in place, which others use as well; write x = x + y, not x += y"
                )
            return result

        return call

    return _wrapped(effect, watched)


def _corners(effect: Effect, model: Model) -> list[Mapping[str, float]]:
    """Lowest, typical and highest value of every parameter, in all combinations; the same for all muscles."""
    choices = [(p.low, p.typical, p.high) for p in effect.parameters.values()]
    points = [dict(zip(effect.parameters, values, strict=True)) for values in itertools.product(*choices)]
    return [{full: value for short, value in p.items() for full in model.names(effect, short)} for p in points]


def _try(model: Model, params: Mapping[str, Number], where: str, only: slice = ALL, more: Number = 0.0) -> Tensor:
    """The measured angle (..., T, N) of a short trial from each first sample, or some, the muscles half active; `more`
    is added to first samples, and that share of itself to all else."""
    first = torch.tensor(list(itertools.product(ANGLES, VELOCITIES)), dtype=torch.float64)[only] + more
    angle, velocity = first.unbind(-1)
    params = {name: value * (1 + more) for name, value in params.items()}
    rising = torch.linspace(0.3, 0.6, SAMPLES, dtype=torch.float64) * (1 + more)
    emg = rising[:, None].expand(len(angle), SAMPLES, len(model.muscles))
    try:
        return simulate(Simulation(model, params, emg, DT), angle, velocity).angle
    except (Exception, SystemExit) as error:  # whatever a user's function may raise
        shapes = f"q {tuple(angle.shape)}, activation {tuple(emg.shape[::2])}"
        raise ValueError(
            f"{where}: calling it (trials without a batch: {shapes}) raised {type(error).__name__}: {error}. "
            "See the table in myowave/physics/effect.py for what a function gets and returns at this stage."
        ) from error
