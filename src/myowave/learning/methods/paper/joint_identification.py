"""Identification as the paper prints it: Adam moves the physical parameters together with the weights, on one loss.

Adam needs numbers of order one without bounds. The values follow from such *raw* numbers:

    ratio        Gamma = Gamma_0 raw, Eq. 37; where Gamma_0 is 0 (an effect), a typical strength times raw
    bounded      Gamma = low + (high - low) sig(raw)
    literature   Gamma = 1/N sum_r gamma_r sig(raw_r), Eq. 41 as printed: from 0 to the mean of the literature

Shapes: S seeds, P parameters, R raw numbers (P, and more where literature values are many), ... leading batch.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from myowave.identification.free_parameters import Free
from myowave.settings import Identify

INSIDE = 0.02  # a search at or beyond the end of a sigmoid's range starts this share of the range inside
ROUNDING = 1e-9  # the same for a value that a search has found


@dataclass(frozen=True)
class Form:
    """How one parameter follows from its raw numbers. `scale` (S,) for a ratio, `low` and `high` limits of any form."""

    kind: str
    scale: Tensor
    low: float
    high: float
    literature: tuple[float, ...] = ()

    @classmethod
    def of(cls, free: Free, wanted: Identify | None, start: Tensor) -> "Form":
        """The form of a parameter whose search starts from `start` (S,)."""
        if wanted and wanted.literature:
            return cls("literature", start, 0.0, sum(wanted.literature) / len(wanted.literature), wanted.literature)
        if wanted and wanted.low is not None and wanted.high is not None:
            return cls("bounded", start, wanted.low, wanted.high)
        if bool((start == 0).all()):
            return cls("ratio", torch.full_like(start, free.scale), free.low, free.high)
        return cls("ratio", start, 0.0, math.inf)

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

    def raw(self, value: Tensor, inside: float) -> Tensor:
        """Raw numbers (S, size) of a value (S,), all the same, at least a share `inside` of the range from its ends."""
        if self.kind == "ratio":
            return (value / self.scale).unsqueeze(-1)
        share = (value - self.low) / (self.high - self.low)
        return torch.logit(share.clamp(inside, 1 - inside)).unsqueeze(-1).expand(-1, self.size)


class JointIdentification:
    """Parameters that move with the weights; see `methods.Parameters`.

    Args:
        wanted: constants to identify, by name.
        start: where the search of each seed started at the coarsest scale, (S, P).
        values: where it goes on, (S, P); `start` at the coarsest scale.
        pace: how many times the step of the weights the raw numbers take.

    `moved` (S, R) is what Adam moves, on the device: raw numbers over the pace, as its steps are of one size whatever
    the gradient.
    """

    def __init__(
        self,
        free: Sequence[Free],
        wanted: Mapping[str, Identify],
        start: Tensor,
        values: Tensor,
        device: torch.device,
        pace: float = 1.0,
    ) -> None:
        inside = INSIDE if torch.equal(start, values) else ROUNDING
        self._names = tuple(p.name for p in free)
        forms = [Form.of(p, wanted.get(p.name), start[:, i]) for i, p in enumerate(free)]
        raw = torch.cat([values[:, :0], *(form.raw(values[:, i], inside) for i, form in enumerate(forms))], dim=-1)
        self._forms = tuple(replace(form, scale=form.scale.to(device)) for form in forms)
        self._pace = pace
        self.moved = (raw / pace).to(device).requires_grad_()

    def _from_raw(self) -> tuple[Tensor, ...]:
        parts = (self._pace * self.moved).split([form.size for form in self._forms], dim=-1)
        return tuple(form.value(part) for form, part in zip(self._forms, parts, strict=True))

    @property
    def values(self) -> Tensor:
        """The parameters as they are now, (S, P), SI units."""
        values = [value.detach().unsqueeze(-1) for value in self._from_raw()]
        return torch.cat([self.moved.detach()[:, :0], *values], dim=-1).cpu()

    @property
    def params(self) -> dict[str, Tensor]:
        """Parameters by name for the physics, each (S, 1); gradients of a loss reach `raw` through them."""
        return {name: value.unsqueeze(-1) for name, value in zip(self._names, self._from_raw(), strict=True)}

    @property
    def mse(self) -> Tensor:
        """How far simulated motion misses the trials, (S,): not known, not a number."""
        return self.values.new_full(self.moved.shape[:1], math.nan)

    def uncertainty(self) -> tuple[Tensor, Tensor]:
        """Standard errors (S, P) and correlations (S, P, P): not known, not a number."""
        errors = torch.full_like(self.values, math.nan)
        return errors, errors.unsqueeze(-1).expand(-1, -1, errors.shape[1]).clone()
