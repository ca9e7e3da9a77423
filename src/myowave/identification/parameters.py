"""The physical parameters that are identified: where they start, how they are normalised and bounded.

The search moves *raw* numbers of order one, from which the values follow:

    ratio        Gamma = Gamma_0 raw, Eq. 37; where Gamma_0 is 0 (an effect), a typical strength times raw
    bounded      Gamma = low + (high - low) sig(raw)
    literature   Gamma = 1/N sum_r gamma_r sig(raw_r), Eq. 41 as printed: from 0 to the mean of the literature

Shapes: S seeds, P parameters, R raw numbers (P, and more where literature values are many), ... leading batch.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from myowave.physics.model import Model
from myowave.settings import Identify

_INSIDE = 0.02  # a start beyond a sigmoid's range begins this share of the range inside


@dataclass(frozen=True)
class Form:
    """How one parameter follows from its raw numbers. `scale` (S,) for a ratio, `low` and `high` limits of any form."""

    kind: str
    scale: Tensor
    low: float
    high: float
    literature: tuple[float, ...] = ()

    @property
    def size(self) -> int:
        return max(1, len(self.literature))

    def value(self, raw: Tensor) -> Tensor:
        """Parameter (..., S) from its raw numbers (..., S, size)."""
        if self.kind == "ratio":
            return (self.scale * raw[..., 0]).clamp(self.low, self.high)
        if self.kind == "bounded":
            return self.low + (self.high - self.low) * torch.sigmoid(raw[..., 0])
        return (raw.new_tensor(self.literature) * torch.sigmoid(raw)).mean(-1)


@dataclass(frozen=True)
class Identified:
    """The list of what is identified, for all seeds."""

    names: tuple[str, ...]
    forms: tuple[Form, ...]

    def to(self, device: torch.device) -> "Identified":
        """The same on another device."""
        return Identified(self.names, tuple(replace(form, scale=form.scale.to(device)) for form in self.forms))

    def values(self, raw: Tensor) -> Tensor:
        """Parameters (..., S, P) from raw numbers (..., S, R)."""
        parts = raw.split([form.size for form in self.forms], dim=-1)
        return torch.stack([form.value(part) for form, part in zip(self.forms, parts, strict=True)], dim=-1)

    def params(self, raw: Tensor) -> dict[str, Tensor]:
        """Parameters by name for the physics, each (..., S, 1), to broadcast against trials."""
        values = self.values(raw)
        return {name: values[..., i].unsqueeze(-1) for i, name in enumerate(self.names)}


def slope_of(identified: Identified, raw: Tensor) -> Tensor:
    """d value / d raw, (S, P, R), by differences."""
    step = 1e-6 * torch.eye(raw.shape[-1], dtype=raw.dtype).unsqueeze(1)
    return ((identified.values(raw + step) - identified.values(raw - step)) / 2e-6).movedim(0, -1)


def identify(
    model: Model, wanted: Mapping[str, Identify], constants: Mapping[str, float], seeds: Sequence[int]
) -> tuple[Identified, Tensor]:
    """What to identify, and its start for every seed.

    Args:
        model: its effects' parameters are identified too, from 0.
        wanted: physical constants by name.
        constants: known constants of the subject, which replace the model's nominal values.

    Returns:
        The list, and raw numbers (S, R), float64.

    Raises:
        ValueError: for a name that the model does not have.
    """
    names = tuple(dict.fromkeys([*wanted, *(n for n in model.effect_parameters if n not in constants)]))
    if unknown := [name for name in names if name not in model.defaults]:
        raise ValueError(
            f"identify: the model {model.name} has no parameter {', '.join(unknown)}; it has "
            f"{', '.join(sorted(model.defaults))}. Correct the name, or add the effect to the model."
        )
    forms, raws = [], []
    for name in names:
        nominal = float(constants.get(name, model.defaults[name]))
        spread = wanted[name].start_spread if name in wanted else 0.0
        start = torch.tensor([nominal * (1 + spread * _draw(seed, name)) for seed in seeds], dtype=torch.float64)
        form, raw = _form(model, name, wanted.get(name), start)
        forms.append(form)
        raws.append(raw)
    return Identified(names, tuple(forms)), torch.cat(raws, dim=-1)


def _form(model: Model, name: str, wanted: Identify | None, start: Tensor) -> tuple[Form, Tensor]:
    """One parameter's form and its raw numbers (S, size) at the start."""
    if wanted and wanted.low is not None:
        low, high = wanted.low, wanted.high
        inside = ((start - low) / (high - low)).clamp(_INSIDE, 1 - _INSIDE)
        return Form("bounded", start, low, high), torch.logit(inside).unsqueeze(-1)
    if wanted and wanted.literature:
        mean = sum(wanted.literature) / len(wanted.literature)
        inside = (start / mean).clamp(_INSIDE, 1 - _INSIDE)
        form = Form("literature", start, 0.0, mean, wanted.literature)
        return form, torch.logit(inside).unsqueeze(-1).expand(-1, form.size)
    effect = model.effect_parameters.get(name)
    low, high = (effect.low, effect.high) if effect else (0.0, float("inf"))
    if bool((start == 0).all()):
        typical = effect.typical if effect else 1.0
        return Form("ratio", torch.full_like(start, typical), low, high), torch.zeros_like(start).unsqueeze(-1)
    return Form("ratio", start, low, high), torch.ones_like(start).unsqueeze(-1)


def _draw(seed: int, name: str) -> float:
    """A number in [-1, 1] that depends on the seed and the parameter's name alone, not on what else is identified."""
    random = torch.Generator().manual_seed(seed * 1_000_003 + int.from_bytes(name.encode()) % 1_000_003)
    return float(2 * torch.rand((), generator=random, dtype=torch.float64) - 1)
