"""What training at one scale leaves behind, and what it may be used for.

A checkpoint is plain data and tensors, read with `torch.load(weights_only=True)`: opening one runs no code. It holds
what it was trained on and how, and is refused, with the reason, where that does not fit.
"""

import hashlib
import json
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
from pydantic import ConfigDict, Field, Json, TypeAdapter, ValidationError
from torch import Tensor

from myowave.data.json_files import replacing
from myowave.data.trials import Trials
from myowave.learning.band import Band, Seen
from myowave.learning.network import Architecture, Network, Scaling, Size
from myowave.physics.curves import Curve
from myowave.physics.model import Model
from myowave.physics.path import Path as MusclePath
from myowave.physics.path import TablePath
from myowave.settings.files import require_regular
from myowave.settings.learning import RECIPES

FORMAT = 4


@dataclass(frozen=True)
class Checkpoint:
    """A trained network with its identified parameters, for all seeds."""

    __pydantic_config__ = ConfigDict(extra="forbid", arbitrary_types_allowed=True)
    # dataset, model, recipe: what it was trained on and how, each with its digest or settings
    dataset: str
    dataset_digest: str
    model: str
    model_digest: str
    recipe: Json[dict[str, Any]]
    # level, scales: trained at scale [-level], of that many scales, for `epochs` and `seconds` through all so far
    level: Annotated[int, Field(ge=0)]
    scales: int
    seeds: tuple[int, ...]  # numbers of the seeds S
    epochs: int
    seconds: float
    dt: Annotated[Size, Field(le=1)]  # sampling interval [s]; `channels` the EMG channels, in the network's order
    channels: tuple[str, ...]
    architecture: Architecture
    scaling: Scaling
    weights: Mapping[str, Tensor]
    # names, values, errors, correlations: identified parameters, their standard errors, (S, P), SI units, and how they
    # are correlated, (S, P, P)
    names: tuple[str, ...]
    values: Tensor
    errors: Tensor
    correlations: Tensor
    # how far motion simulated with the values misses the training trials [rad^2], (S,); infinite where it diverges, NaN
    # where nobody simulated it
    physics_mse: Tensor
    # on the validation windows, (S,); no weight was trained on them, but the identification of the parameters, and so
    # the motion simulated for training, has seen them
    val_r2: Tensor
    band: Band | None  # about the mean of the seeds, see `band`; None but at scale [0], and where the recipe wants none
    seen: Seen  # what the training trials covered
    # how raw EMG became that of the trials, as `RealTime` has it; empty where it came processed
    real_time: Json[dict[str, Any]]

    @property
    def network(self) -> Network:
        """The trained network."""
        return Network(self.architecture, self.scaling, self.weights)

    def save(self, path: str | Path) -> None:
        """Write the checkpoint, atomically."""
        content = asdict(self) | {
            "format": FORMAT,
            "recipe": json.dumps(dict(self.recipe)),
            "real_time": json.dumps(dict(self.real_time)),
            "weights": {name: value.cpu() for name, value in self.weights.items()},
        }
        with replacing(path) as temporary:
            torch.save(content, temporary)

    @classmethod
    def load(cls, path: str | Path) -> "Checkpoint":
        """Read a checkpoint. A ValueError for a file that is none, is damaged, or of another version; an OSError for
        one that is not there, or may not be read."""
        require_regular(Path(path))
        with open(path, "rb") as file:
            try:
                # Sums of all parts, as torch would load numbers that a disk or a copy has changed.
                damaged = zipfile.ZipFile(file).testzip()
                content: Any = None if damaged else torch.load(path, map_location="cpu", weights_only=True)
            except Exception as error:  # whatever such bytes make the reader raise
                raise ValueError(
                    f"{path}: not a checkpoint of myowave ({type(error).__name__}). Train it again."
                ) from None
        if damaged:
            raise ValueError(f"{path}: this checkpoint is damaged (in {damaged}). Copy it again, or train it again.")
        found = content.pop("format", None) if isinstance(content, dict) else None
        if found != FORMAT:
            raise ValueError(f"{path}: checkpoint format is {found}, expected {FORMAT}. Train it again.")
        try:
            checkpoint: Checkpoint = _READER.validate_python(content)
        except ValidationError as error:
            wrong = error.errors()[0]
            where = ".".join(map(str, wrong["loc"]))
            raise ValueError(
                f"{path}: this checkpoint cannot be used, or is of another version of myowave: {where}: "
                f"{wrong['msg']}, found {str(wrong['input']):.60}. Train it again."
            ) from None
        if not _fits(checkpoint):
            raise ValueError(
                f"{path}: this checkpoint cannot be used: its weights, channels, seeds, parameters, scaling and ranges "
                "do not fit each other, or are not finite. Train it again."
            )
        return checkpoint

    def require(self, **expected: Any) -> None:
        """A ValueError for the first of these fields that has another value here, with both."""
        for name, value in expected.items():
            found = getattr(self, name)
            if found != value:
                where, found, value = _difference(name, found, value)
                raise ValueError(
                    f"checkpoint of {self.dataset}, {self.model}, scale -{self.level} of {self.scales}: {where} was "
                    f"{found} when it was trained, and is {value} now. Remove it and train again."
                )


_READER = TypeAdapter(Checkpoint)


def _fits(c: Checkpoint) -> bool:
    """What must hold of a checkpoint beyond the limits of each number."""
    a, seeds, told = c.architecture, len(c.seeds), len(c.architecture.given.told)
    return (
        a.method in RECIPES
        and {name: tuple(weight.shape) for name, weight in c.weights.items()}
        == {name: (seeds, *shape) for name, shape in a.shapes.items()}
        and all(weight.is_floating_point() and weight.layout == torch.strided for weight in c.weights.values())
        and all(bool(values.isfinite().all()) for values in (*c.weights.values(), c.values))
        and a.channels == len(c.channels) == len(set(c.channels))
        and len(a.delays) in (0, a.channels)
        and len(c.scaling.input_mean) == len(c.scaling.input_std) == a.channels + told
        and 0 < seeds == len(set(c.seeds))
        and c.values.shape == c.errors.shape == (seeds, len(set(c.names)))
        and c.correlations.shape == (*c.values.shape, len(c.names))
        and len(c.seen.low) == len(c.seen.high) == a.channels + len(a.known) + 2
        and all(low <= high for low, high in zip(c.seen.low, c.seen.high, strict=True))
        and c.level < c.scales
    )


def _difference(name: str, found: Any, expected: Any) -> tuple[str, Any, Any]:
    if isinstance(found, Mapping) and isinstance(expected, Mapping):
        key = next(k for k in [*expected, *found] if found.get(k) != expected.get(k))
        return f"{name}.{key}", found.get(key), expected.get(key)
    return name, found, expected


def digest_trials(trials: Trials) -> str:
    """Digest of the numbers and labels that training sees or keeps, so that a checkpoint knows its data."""
    digest = hashlib.sha256()
    labels = [trials.dataset, trials.dt, trials.names, trials.channels, trials.lengths, trials.test]
    signals = [*trials.signals, *trials.over_time.items()]
    known = [{name: dict(values) for name, values in trials.conditions.items()}, dict(trials.constants)]
    digest.update(json.dumps([*labels, *signals, *known, dict(trials.real_time)], sort_keys=True).encode())
    for values in (trials.emg, trials.angle, *trials.signals.values()):
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()[:16]


def digest_model(model: Model) -> str:
    """Digest of a model's nominal constants, what drives each muscle along which path, its curves and its effects."""
    shapes = model.curves
    curves = [_named(curve) for curve in (shapes.active_length, shapes.passive, shapes.force_velocity)]
    curves += [f"slowing {shapes.slowing}"] if shapes.slowing else []
    muscles = [[m.name, m.channel, m.side, m.group, _drawn(m.path)] for m in model.muscles]
    effects = [[effect.name, effect.equation] for effect in model.effects]
    parts = [dict(model.defaults), curves, muscles, effects]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:16]


def _drawn(path: MusclePath) -> list[Any]:
    """What a path is beside its constants."""
    if not isinstance(path, TablePath):
        return [path.kind]
    return [path.kind, path.cubics.low, path.cubics.width, path.cubics.coefficients.tolist()]


def _named(curve: Curve) -> str:
    return f"{curve.func.__name__} {curve.args} {curve.keywords}" if isinstance(curve, partial) else curve.__name__
