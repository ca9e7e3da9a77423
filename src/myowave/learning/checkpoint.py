"""What training at one scale leaves behind, and what it may be used for.

A checkpoint is plain data and tensors, read with `torch.load(weights_only=True)`: opening one runs no code. It holds
what it was trained on and how, and is refused, with the reason, where that does not fit.
"""

import hashlib
import json
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from myowave.data.store import replacing
from myowave.data.trials import Trials
from myowave.learning.band import Band
from myowave.learning.inputs import Given
from myowave.learning.network import Architecture, Network, Scaling
from myowave.learning.seen import Seen
from myowave.settings.files import require_regular
from myowave.settings.learning import RECIPES

FORMAT = 3


@dataclass(frozen=True)
class Checkpoint:
    """A trained network with its identified parameters, for all seeds.

    Args:
        dataset, dataset_digest: what it was trained on; see `digest_trials`.
        model: name of the physical model.
        model_digest: of the model's constants and curves' names.
        recipe: settings of the recipe.
        level, scales: trained at scale [-level], of that many scales.
        seeds: numbers of the seeds S.
        epochs: through all scales so far; `seconds` likewise.
        dt: sampling interval [s]; `channels` the EMG channels, in the network's order.
        weights: of the network, leading axis S.
        names, values, errors: identified parameters and their standard errors, (S, P), SI units.
        correlations: between the identified parameters, (S, P, P).
        physics_mse: how far motion simulated with the values misses the training trials [rad^2], (S,); infinite where
            it diverges, NaN where nobody simulated it.
        val_mse, val_r2: on the validation windows, (S,); no weight was trained on them, but the identification of the
            parameters, and so the motion simulated for training, has seen them.
        band: about the mean of the seeds, see `band`; None but at scale [0], and where the recipe wants none.
        seen: what the training trials covered.
        real_time: how raw EMG became that of the trials, as `RealTime.plain` gives it; empty where it came processed.
    """

    dataset: str
    dataset_digest: str
    model: str
    model_digest: str
    recipe: Mapping[str, Any]
    level: int
    scales: int
    seeds: tuple[int, ...]
    epochs: int
    seconds: float
    dt: float
    channels: tuple[str, ...]
    architecture: Architecture
    scaling: Scaling
    weights: Mapping[str, Tensor]
    names: tuple[str, ...]
    values: Tensor
    errors: Tensor
    correlations: Tensor
    physics_mse: Tensor
    val_mse: Tensor
    val_r2: Tensor
    band: Band | None
    seen: Seen
    real_time: Mapping[str, Any]

    @property
    def network(self) -> Network:
        """The trained network."""
        return Network(self.architecture, self.scaling, self.weights)

    def save(self, path: str | Path) -> None:
        """Write the checkpoint, atomically."""
        content = {f.name: getattr(self, f.name) for f in fields(self)}
        content |= {
            "format": FORMAT,
            "recipe": json.dumps(dict(self.recipe)),
            "architecture": asdict(self.architecture),
            "scaling": asdict(self.scaling),
            "band": asdict(self.band) if self.band else None,
            "seen": asdict(self.seen),
            "real_time": json.dumps(dict(self.real_time)),
            "weights": {name: value.cpu() for name, value in self.weights.items()},
        }
        with replacing(path) as temporary:
            torch.save(content, temporary)

    @classmethod
    def load(cls, path: str | Path, device: torch.device | str = "cpu") -> "Checkpoint":
        """Read a checkpoint.

        Raises:
            ValueError: for a file that is none, is damaged, or of another version.
            OSError: for one that is not there, or may not be read.
        """
        content: Any = None
        require_regular(Path(path))
        with open(path, "rb") as file:
            try:
                # Sums of all parts, as torch would load numbers that a disk or a copy has changed.
                damaged = zipfile.ZipFile(file).testzip()
                content = None if damaged else torch.load(path, map_location=device, weights_only=True)
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
            content["recipe"] = json.loads(content["recipe"])
            architecture = content["architecture"]
            content["architecture"] = Architecture(**{**architecture, "given": Given(**architecture["given"])})
            content["scaling"] = Scaling(**content["scaling"])
            content["band"] = Band(**content["band"]) if content["band"] else None
            content["seen"] = Seen(**content["seen"])
            content["real_time"] = json.loads(content["real_time"])
            checkpoint = cls(**content)
            wrong = next((why for why, holds in _SOUND.items() if not holds(checkpoint)), None)
        except (KeyError, TypeError, ValueError, AttributeError) as error:  # fields are missing, unknown or others
            raise ValueError(f"{path}: written by another version of myowave ({error}). Train it again.") from None
        if wrong:
            raise ValueError(f"{path}: this checkpoint cannot be used: {wrong}. Train it again.")
        return checkpoint

    def require(self, **expected: Any) -> None:
        """Refuse what does not fit.

        Args:
            **expected: fields of the checkpoint and the values they must have.

        Raises:
            ValueError: naming the first field that differs, with both values.
        """
        for name, value in expected.items():
            found = getattr(self, name)
            if found != value:
                where, found, value = _difference(name, found, value)
                raise ValueError(
                    f"checkpoint of {self.dataset}, {self.model}, scale -{self.level} of {self.scales}: {where} was "
                    f"{found} when it was trained, and is {value} now. Remove it and train again."
                )


def _shapes(checkpoint: Checkpoint) -> dict[str, tuple[int, ...]]:
    """Shapes of the weights that the architecture asks for."""
    a, one = checkpoint.architecture, len(checkpoint.seeds)
    rows = {"hidden": a.hidden, "input": a.inputs, "angle": a.features, "bias": 1}
    outputs = {"output": (one, a.hidden, 1), "output_bias": (one, 1, 1), "state_bias": (one, 1, a.hidden)}
    return {**{name: (one, n, a.gates) for name, n in rows.items()}, **outputs}


def _finite(*values: Any) -> bool:
    return all(bool(torch.isfinite(torch.as_tensor(value)).all()) for value in values)


def _scaled(s: Scaling, inputs: int) -> bool:
    sizes = (*s.input_std, s.angle_std, s.step_std, s.bend_std, s.duration)
    return (
        len(s.input_mean) == len(s.input_std) == inputs
        and min(sizes) > 0
        and _finite(s.input_mean, s.angle_mean, sizes)
    )


# What must hold of a checkpoint, by what is said where it does not; each may build on those before.
_SOUND: Mapping[str, Callable[[Checkpoint], bool]] = {
    "there is no such method to train a network": lambda c: c.architecture.method in RECIPES,
    "channels and their number differ": lambda c: c.architecture.channels == len(c.channels) == len(set(c.channels)),
    "a delay for each channel is expected, or none, of 0 to 1 s": lambda c: (
        len(c.architecture.delays) in (0, len(c.channels)) and all(0 <= delay <= 1 for delay in c.architecture.delays)
    ),
    "it needs at least one sample of known angle": lambda c: c.architecture.history >= 1,
    "seeds are none, or some are there twice": lambda c: 0 < len(c.seeds) == len(set(c.seeds)),
    "weights have other shapes than its network": lambda c: (
        {k: tuple(w.shape) for k, w in c.weights.items()} == _shapes(c)
    ),
    "weights are no finite numbers": lambda c: _finite(*c.weights.values()),
    "the scaling of inputs and angles does not fit": lambda c: _scaled(
        c.scaling, c.architecture.channels + len(c.architecture.given.told)
    ),
    "the time between samples is no positive number": lambda c: _finite(c.dt) and c.dt > 0,
    "the scale is none of those that were trained": lambda c: 0 <= c.level < c.scales,
    "parameters and their values differ in number": lambda c: (
        c.values.shape == c.errors.shape == (len(c.seeds), len(c.names))
        and c.correlations.shape == (*c.values.shape, len(c.names))
    ),
    "parameters are no finite numbers": lambda c: _finite(c.values),
    "the band has no width": lambda c: c.band is None or (c.band.factor > 0 and c.band.floor > 0),
    "ranges of the training trials do not fit its inputs": lambda c: (
        len(c.seen.low) == len(c.seen.high) == c.architecture.channels + len(c.architecture.known) + 2
    ),
}


def _difference(name: str, found: Any, expected: Any) -> tuple[str, Any, Any]:
    if isinstance(found, Mapping) and isinstance(expected, Mapping):
        key = next(k for k in [*expected, *found] if found.get(k) != expected.get(k))
        return f"{name}.{key}", found.get(key), expected.get(key)
    return name, found, expected


def digest_trials(trials: Trials) -> str:
    """Digest of the numbers and labels that training sees, so that a checkpoint knows its data."""
    digest = hashlib.sha256()
    labels = [trials.dataset, trials.dt, trials.names, trials.channels, trials.lengths, trials.test]
    signals = [*trials.signals, *trials.over_time.items()]
    known = {name: dict(values) for name, values in trials.conditions.items()}
    digest.update(json.dumps([*labels, *signals, known, dict(trials.constants)], sort_keys=True).encode())
    for values in (trials.emg, trials.angle, *trials.signals.values()):
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()[:16]


def digest_model(defaults: Mapping[str, float], curves: Sequence[str]) -> str:
    """Digest of a model's nominal constants and its curves."""
    return hashlib.sha256(json.dumps([dict(defaults), list(curves)], sort_keys=True).encode()).hexdigest()[:16]
