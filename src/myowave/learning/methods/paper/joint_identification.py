"""Identification as the paper prints it: Adam moves the physical parameters together with the weights, on one loss.

Adam needs numbers of order one without bounds. The values follow from such *raw* numbers:

    ratio        Gamma = Gamma_0 raw, Eq. 37; where Gamma_0 is 0 (an effect), a typical strength times raw
    bounded      Gamma = low + (high - low) sig(raw)
    literature   Gamma = 1/N sum_r gamma_r sig(raw_r), Eq. 41 as printed: from 0 to the mean of the literature

Shapes: S seeds, P parameters, R raw numbers (P, and more where literature values are many), ... leading batch.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from myowave.identification.free_parameters import Free
from myowave.settings import Identify

INSIDE = 0.02  # a search at or beyond the end of a sigmoid's range starts this share of the range inside
ROUNDING = 1e-9  # the same for a value that a search has found


@dataclass(frozen=True)
class Form:
    """How one parameter, between `low` and `high`, follows from its raw numbers: sigmoids of them times `sizes` are
    averaged; where there are none it is a ratio, times a `scale` (S,)."""

    low: float
    high: float
    sizes: tuple[float, ...]
    scale: Tensor

    @classmethod
    def of(cls, free: Free, wanted: Identify | None, start: Tensor) -> "Form":
        """The form of a parameter whose search starts from `start` (S,)."""
        if wanted and wanted.literature:
            return cls(0.0, sum(wanted.literature) / len(wanted.literature), wanted.literature, start)
        if wanted and wanted.low is not None and wanted.high is not None:
            return cls(wanted.low, wanted.high, (wanted.high - wanted.low,), start)
        if bool((start == 0).all()):
            return cls(free.low, free.high, (), torch.full_like(start, free.scale))
        return cls(0.0, math.inf, (), start)

    def value(self, raw: Tensor) -> Tensor:
        """Parameter (..., S) from its raw numbers (..., S, R)."""
        if self.sizes:
            return self.low + (raw.new_tensor(self.sizes) * torch.sigmoid(raw)).mean(-1)
        return (self.scale.to(raw.device) * raw[..., 0]).clamp(self.low, self.high)

    def raw(self, value: Tensor, inside: float) -> Tensor:
        """Raw numbers (S, R) of a value (S,), all the same, at least a share `inside` of the range from its ends."""
        if self.sizes:
            share = (value - self.low) / (self.high - self.low)
            return torch.logit(share.clamp(inside, 1 - inside)).unsqueeze(-1).expand(-1, len(self.sizes))
        return (value / self.scale).unsqueeze(-1)


class JointIdentification:
    """Parameters that move with the weights; see `methods`.

    `moved` (S, R) is what Adam moves, on the device: raw numbers over the pace, as its steps are of one size whatever
    the gradient.

    Args:
        start: where the search of each seed started at the coarsest scale, (S, P).
        values: where it goes on, (S, P); `start` at the coarsest scale.
        pace: how many times the step of the weights the raw numbers take.
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
        self._forms = {p.name: Form.of(p, wanted.get(p.name), start[:, i]) for i, p in enumerate(free)}
        inside = INSIDE if torch.equal(start, values) else ROUNDING
        raw = [form.raw(values[:, i], inside) for i, form in enumerate(self._forms.values())]
        self._pace, self._sizes = pace, [part.shape[-1] for part in raw]
        self.moved = (torch.cat([values[:, :0], *raw], dim=-1) / pace).to(device).requires_grad_()

    @property
    def params(self) -> dict[str, Tensor]:
        """Parameters by name for the physics, each (S, 1); gradients of a loss reach `moved` through them."""
        parts = (self._pace * self.moved).split(self._sizes, dim=-1)
        return {
            name: form.value(part).unsqueeze(-1) for (name, form), part in zip(self._forms.items(), parts, strict=True)
        }

    @property
    def values(self) -> Tensor:
        """The parameters as they are now, (S, P), SI units."""
        return torch.cat([self.moved[:, :0], *self.params.values()], dim=-1).detach().cpu()

    def judge(self) -> None:
        """Standard errors, and how far simulated motion misses the trials, are not known."""
