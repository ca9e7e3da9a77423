"""No identification: parameters stay where their search would start, and only the motion is learned."""

import math

import torch
from torch import Tensor


class Unidentified:
    """Parameters that nothing moves; with the interface of `learning.identification.Identification`.

    Args:
        values: of the parameters, (S, P), SI units.
    """

    done = True

    def __init__(self, values: Tensor) -> None:
        self.values = values
        self.params: dict[str, Tensor] = {}

    @property
    def mse(self) -> Tensor:
        """How far simulated motion misses the trials, (S,): not known, not a number."""
        return self.values.new_full(self.values.shape[:1], math.nan)

    def uncertainty(self) -> tuple[Tensor, Tensor]:
        """Standard errors (S, P) and correlations (S, P, P): not known, not a number."""
        errors = torch.full_like(self.values, math.nan)
        return errors, errors.unsqueeze(-1).expand(-1, -1, errors.shape[1]).clone()
