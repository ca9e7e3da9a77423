"""Gauss-Newton identification beside the training of the weights: first the weak residual, then whole trajectories.

A step an epoch, at the beginning of a scale. The weak residual converges from any start; trajectories follow at scale
[0], or at once where the model has an effect that a measured angle alone does not determine.

Why along the measured angle and not along the network's own predictions: a one-step prediction misses a few percent
of what changes within a sample, and the parameters take that for weaker muscles. Measured in case 1, 600 epochs: f0_Bi
-0.35, l0_Bi -0.09, f0_Tri -0.30, l0_Tri -0.02 % along the predictions, and at most 0.004 % along the angle.
"""

import torch
from torch import Tensor

from myowave.data.trials import Trials
from myowave.identification.parameters import Identified, slope_of
from myowave.identification.shooting import Shooting
from myowave.identification.weak import WeakResidual, gauss_newton, hidden_effects
from myowave.physics.model import Model

WEAK_STEPS = 8
SHOOTING_STEPS = 5
BLOCK_S = 1.0  # residuals further apart than this count as independent


class Identification:
    """The parameters of all seeds and how far their search is.

    Args:
        trials: training trials, all their samples.
        finest: whether trajectories are to have the last word.
    """

    def __init__(self, model: Model, trials: Trials, identified: Identified, raw: Tensor, *, finest: bool) -> None:
        hidden = bool(hidden_effects(model))
        self.raw = raw
        self._model, self._trials, self._identified = model, trials, identified
        self._weak = None if hidden else WeakResidual.of(model, trials).along(torch.from_numpy(trials.angle)[None])
        self._damping = torch.full((raw.shape[0],), 1e-3, dtype=raw.dtype)
        self._shooting: Shooting | None = None
        self._plan = ["weak"] * WEAK_STEPS * (not hidden) + ["shoot"] * SHOOTING_STEPS * (finest or hidden)

    @property
    def done(self) -> bool:
        """Whether all steps were taken."""
        return not self._plan

    @property
    def mse(self) -> Tensor:
        """How far the physics misses the training trials [rad^2], (S,)."""
        return self._shoot().mse

    def step(self) -> None:
        """The next step of the search."""
        if self._plan.pop(0) == "weak":
            self.raw, self._damping = gauss_newton(self._weak, self._identified, self.raw, self._damping)
        else:
            self._shooting = self._shoot().step()
            self.raw = self._shooting.raw

    def _shoot(self) -> Shooting:
        if self._shooting is None:
            self._shooting = Shooting.of(self._model, self._trials, self._identified, self.raw)
        return self._shooting

    def uncertainty(self) -> tuple[Tensor, Tensor]:
        """Standard errors of the values (S, P), SI units, and how far they are confounded, correlations (S, P, P).

        From the residuals of the trajectories in blocks of `BLOCK_S`, so that it holds for errors of any colour: noise
        on the angle, and what the physics cannot explain.
        """
        residual, jacobian = self._shoot().linearise()
        slope = slope_of(self._identified, self.raw)
        inverse = torch.linalg.pinv((jacobian.mT @ jacobian).sum(1), hermitian=True)
        scores = jacobian * residual.unsqueeze(-1)  # (S, T, N, R)
        pieces = scores.split(max(1, round(BLOCK_S / self._trials.dt)), dim=2)
        blocks = torch.cat([piece.sum(2) for piece in pieces], dim=1)
        spread = slope @ inverse @ (blocks.mT @ blocks) @ inverse @ slope.mT
        shape = slope @ inverse @ slope.mT
        size = torch.diagonal(shape, dim1=-2, dim2=-1).clamp(min=1e-300).sqrt()
        errors = torch.diagonal(spread, dim1=-2, dim2=-1).clamp(min=0).sqrt()
        return errors, shape / (size.unsqueeze(-1) * size.unsqueeze(-2))
