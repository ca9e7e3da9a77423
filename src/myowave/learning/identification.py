"""Identification beside the training of the weights: a Gauss-Newton step for every seed at each epoch.

At the beginning of a scale the weak form along the measured motion, which converges from any start; at scale [0] then
output error on whole trajectories. A model with an effect that a measured angle alone does not determine goes by output
error at every scale.

Why along the measured angle and not along the network's own predictions: a one-step prediction misses a few percent
of what changes within a sample, and the parameters take that for weaker muscles. Measured in case 1, 600 epochs: f0_Bi
-0.35, l0_Bi -0.09, f0_Tri -0.30, l0_Tri -0.02 % along the predictions, and at most 0.004 % along the angle.

Shapes: S seeds, P parameters.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import islice, zip_longest

import numpy as np
import torch
from torch import Tensor

from myowave.data.trials import Trials
from myowave.identification.free_parameters import Free, bind_values
from myowave.identification.least_squares import correlations, search
from myowave.identification.output_error import LIFTED_STEPS, Fit, LiftedSearch, descend
from myowave.identification.record import make_record
from myowave.identification.torque import TorqueBalance, effects_unseen_by_angle
from myowave.physics.model import Model

WEAK_STEPS = 8


class Identification:
    """The parameters of all seeds and how far their search is; see `methods`.

    Args:
        trials: training trials, all their samples.
        values: where each seed starts, (S, P).
        finest: whether trajectories are to have the last word.
    """

    def __init__(self, model: Model, trials: Trials, free: Sequence[Free], values: Tensor, *, finest: bool) -> None:
        self._model, self._free = model, tuple(free)
        self._record = make_record(trials, model)
        self._values = values.numpy().copy()
        self._fits: list[Fit | None] | None = None  # None where a motion diverges
        self._steps = self._search(finest)
        self.done = False

    @property
    def values(self) -> Tensor:
        """The parameters as they are now, (S, P), SI units."""
        return torch.from_numpy(self._values.copy())

    @property
    def params(self) -> dict[str, Tensor]:
        """Parameters by name for the physics, each (S, 1)."""
        return bind_values(self._free, self._values)

    @property
    def mse(self) -> Tensor:
        """How far the physics misses the training trials [rad^2], (S,); infinite where its motion diverges."""
        errors = [np.inf if fit is None else fit.rmse() ** 2 for fit in self._fitted()]
        return torch.tensor(errors, dtype=torch.float64)

    def judge(self) -> tuple[Tensor, Tensor, Tensor]:
        """Standard errors of the values (S, P), SI units, how far they are confounded, correlations (S, P, P), see
        `Fit.covariance`, and `mse`. The first two are not a number where the motion diverges."""
        unknown = np.full((len(self._free), len(self._free)), np.nan)
        covariances = [unknown if fit is None else fit.covariance() for fit in self._fitted()]
        errors = np.sqrt([np.diag(c) for c in covariances])
        return torch.from_numpy(errors), torch.from_numpy(np.stack([correlations(c) for c in covariances])), self.mse

    def step(self) -> None:
        """The next step of every seed's search; `done` once there is none."""
        self.done = next(self._steps, "end") == "end"

    def _search(self, finest: bool) -> Iterator[None]:
        if not self._free:
            return
        start, unseen = self._values.copy(), bool(effects_unseen_by_angle(self._model))
        if not unseen:
            residual = partial(TorqueBalance.between_kinks(self._model, self._record).unmoved, self._free)
            for values in islice(search(residual, self._free, start, WEAK_STEPS), WEAK_STEPS):
                self._values = values
                yield
            if not finest:
                return
        lifted = self._begin()
        for _ in range(LIFTED_STEPS if unseen else 0):
            lifted = lifted.lifted()
            self._values = lifted.values
            yield
        self._fits = list(lifted.fits())
        if unseen:  # else values stay what explains the measured motion best where that of the model diverges
            self._values = np.where([[fit is None] for fit in self._fits], start, self._values)
        descents = {seed: descend(fit) for seed, fit in enumerate(self._fits) if fit is not None}
        for fits in zip_longest(*descents.values()):
            for seed, fit in zip(descents, fits, strict=True):
                if fit is not None:
                    self._fits[seed], self._values[seed] = fit, fit.values
            yield

    def _begin(self) -> LiftedSearch:
        return LiftedSearch.begin(self._model, self._record, self._free, self._values)

    def _fitted(self) -> list[Fit | None]:
        """The fit of each seed where its search stands."""
        return list(self._begin().fits()) if self._fits is None else self._fits
