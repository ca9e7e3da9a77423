"""Identification by whole trajectories: the motion that the physics gives from EMG against the measured one.

The weak residual (`weak`) finds the parameters from any start in a few steps, but it takes the measured angle for the
true one and cannot follow states that no angle shows. Comparing simulated with measured motion does neither harm: noise
on the angle averages out, every effect may take part, and where the physics is wrong it becomes the best simulator of
these trials that it can be. It needs a near start, so it comes second.

Shapes: S seeds, T trials, N samples, K numbers of a state, P parameters, R raw numbers.
"""

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from myowave.data.trials import Trials
from myowave.identification.parameters import Identified, slope_of
from myowave.identification.weak import known_params
from myowave.physics.drive import channels_of
from myowave.physics.model import Model
from myowave.physics.simulation import Simulation
from myowave.physics.trajectory import Sensitive, solve

LARGEST_STEP = 0.2  # of raw numbers


@dataclass(frozen=True)
class Shooting:
    """Trajectories of the training trials for some parameters; `step` gives those of better ones.

    Args:
        raw: (S, R).
        start: angle and velocity at the first sample, (S, T, 2), found along with the parameters.
        motion: with sensitivities.
        damping: (S,), relative to the diagonal of the normal matrix.
    """

    model: Model
    trials: Trials
    identified: Identified
    raw: Tensor
    start: Tensor
    motion: Sensitive
    damping: Tensor

    @classmethod
    def of(cls, model: Model, trials: Trials, identified: Identified, raw: Tensor) -> "Shooting":
        angle = torch.from_numpy(trials.angle)
        start = torch.stack([angle[:, 0], (angle[:, 1] - angle[:, 0]) / trials.dt], -1).expand(raw.shape[0], -1, -1)
        motion = _solve(model, trials, identified, raw, start, None)
        return cls(model, trials, identified, raw, start, motion, torch.full((raw.shape[0],), 1e-3, dtype=raw.dtype))

    @property
    def residual(self) -> Tensor:
        """Measured minus simulated angle [rad], 0 beyond the record, (S, T, N)."""
        valid = torch.from_numpy(self.trials.valid)
        return (torch.from_numpy(self.trials.angle) - self.motion.motion.angle).nan_to_num(nan=1e3) * valid

    @property
    def mse(self) -> Tensor:
        """How far the physics misses the training trials [rad^2], (S,)."""
        return self.residual.square().sum((-1, -2)) / int(self.trials.valid.sum())

    def _sensitivities(self) -> tuple[Tensor, Tensor]:
        """d angle / d raw (S, T, N, R), and an orthonormal basis of what the start can explain (S, T, N, 2)."""
        valid = torch.from_numpy(self.trials.valid)[..., None]
        by_value = self.motion.by_parameter.movedim(0, -1) * valid
        by_start = self.motion.by_start.movedim(0, -1) * valid
        by_raw = by_value @ slope_of(self.identified, self.raw).unsqueeze(1)
        return by_raw.nan_to_num(), by_start.nan_to_num()

    def step(self) -> "Shooting":
        """One damped Gauss-Newton step of parameters and starts, taken for the seeds where it lowers the error."""
        residual, (by_raw, by_start) = self.residual, self._sensitivities()
        basis, triangle = torch.linalg.qr(by_start)
        projected = by_raw - basis @ (basis.mT @ by_raw)
        normal = (projected.mT @ by_raw).sum(1)
        gradient = (projected.mT @ residual.unsqueeze(-1)).sum(1)
        diagonal = torch.diagonal(normal, dim1=-2, dim2=-1)
        ridge = self.damping.unsqueeze(-1) * diagonal + 1e-12 * diagonal.amax(-1, keepdim=True).clamp(min=1e-30)
        change = torch.linalg.solve(normal + torch.diag_embed(ridge), gradient).squeeze(-1)
        change = change * (LARGEST_STEP / change.abs().amax(-1, keepdim=True).clamp(min=LARGEST_STEP))
        left = residual.unsqueeze(-1) - by_raw @ change[:, None, :, None]
        shift = torch.linalg.solve(triangle, basis.mT @ left).squeeze(-1)
        moved = replace(self, raw=self.raw + change, start=self.start + shift)
        motion = _solve(self.model, self.trials, self.identified, moved.raw, moved.start, self.motion.motion.state)
        moved = replace(moved, motion=motion)
        better = moved.mse < self.mse
        damping = torch.where(better, self.damping / 10, self.damping * 10).clamp(1e-9, 1e6)
        if bool(better.all()):
            return replace(moved, damping=damping)
        raw = torch.where(better.unsqueeze(-1), moved.raw, self.raw)
        start = torch.where(better[:, None, None], moved.start, self.start)
        motion = _solve(self.model, self.trials, self.identified, raw, start, self.motion.motion.state)
        return replace(self, raw=raw, start=start, motion=motion, damping=damping)

    def linearise(self) -> tuple[Tensor, Tensor]:
        """Residual (S, T, N) and its Jacobian (S, T, N, R), without what the starts can explain."""
        residual, (by_raw, by_start) = self.residual, self._sensitivities()
        basis, _ = torch.linalg.qr(by_start)
        residual = residual - (basis @ (basis.mT @ residual.unsqueeze(-1))).squeeze(-1)
        return residual, by_raw - basis @ (basis.mT @ by_raw)


def _solve(
    model: Model, trials: Trials, identified: Identified, raw: Tensor, start: Tensor, guess: Tensor | None
) -> Sensitive:
    emg = channels_of(model, trials.channels, torch.from_numpy(trials.emg))
    params = {**known_params(trials, model), **identified.params(raw)}
    sizes = dict(zip(identified.names, identified.values(raw).abs().amax(0).clamp(min=1e-3).tolist(), strict=True))
    return solve(Simulation(model, params, emg, trials.dt), start[..., 0], start[..., 1], guess=guess, wrt=sizes)
