"""What a motion follows from, but for where it starts: a model, values of its parameters, and the EMG that drives it.

Shapes: ... batch, T trials, N samples, n positions, D points within a step, M muscles, P parameters.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import torch
from torch import Tensor

from myowave.physics.drive import Drive, activate, between_samples, drive_muscles
from myowave.physics.model import Model, Params
from myowave.physics.valued import Valued, give_values


@dataclass(frozen=True, eq=False)
class Simulation:
    """A model, ready to be simulated. Parameters get values and the drive is made once, when first needed.

    Args:
        params: values by name, each broadcastable to (..., T); the rest take the model's defaults.
        emg: one channel per muscle, (..., T, N, M), every `dt` seconds; see `drive.channels_of`.
        dt: sampling interval [s].
        substeps: Runge-Kutta steps for each piece between two kinks of the activation.
        lead: samples of EMG before the first sample of the motion, for muscles that answer late.
        course: how far the first V of the constants `OVER_TIME` are from their values for the trial at every sample of
            the motion, (..., T, N - lead, V); None where they stay there.

    Raises:
        ValueError: when parameters get values or change, for a name that the model does not have.
    """

    model: Model
    params: Params
    emg: Tensor
    dt: float
    substeps: int = 1
    lead: int = 0
    course: Tensor | None = None

    @cached_property
    def valued(self) -> Valued:
        """The model with values for all its parameters."""
        return give_values(self.model, self.params, self.emg)

    @cached_property
    def along_time(self) -> Valued:
        """The same, broadcastable to quantities (..., T, N)."""
        return self.valued.along(1)

    @cached_property
    def drive(self) -> Drive:
        """Excitation and activation of every muscle at the points of every step."""
        return drive_muscles(self.valued, self.emg, self.dt, self.substeps, self.lead, self.course)

    def activate(self, position: Tensor) -> tuple[Tensor, Tensor]:
        """Excitation and activation at positions (..., T, n, D, 1), in samples of the motion: (..., T, n, D, M)."""
        return activate(self.valued, self.emg, position + self.lead, self.dt)

    def course_at(self, position: Tensor) -> Tensor | None:
        """The same of `course`: (..., T, n, D, V)."""
        return None if self.course is None else between_samples(self.course, position)

    def with_params(self, params: Params) -> "Simulation":
        """The same with other values for some parameters; it shares the drive if none of them changes it."""
        self.model.check_names(params)
        changed = replace(self, params={**self.params, **params})
        if "drive" in vars(self) and not any(self.model.drives(name) for name in params):
            vars(changed)["drive"] = self.drive  # where a cached property keeps its value
        return changed

    def nudged(self, wrt: Mapping[str, float], reach: float, axes: int) -> tuple["Simulation", Tensor]:
        """One more axis in front of the batch, along which one parameter after the other is moved a little.

        Args:
            wrt: the parameters, with the size of a usual change of each.
            reach: how far they are moved, in units of that size.
            axes: of the batch (..., T) in front of which the new one stands.

        Returns:
            The simulation of all moved copies, (P, ..., T), and by how much each parameter was moved, (P,).
        """
        self.model.check_names(wrt)
        nudges = reach * torch.tensor([*wrt.values()], dtype=self.emg.dtype, device=self.emg.device)
        moved = {}
        for name, shift in zip(wrt, torch.diag(nudges), strict=True):
            value = self.params.get(name, self.model.defaults[name])
            value = torch.as_tensor(value, dtype=self.emg.dtype, device=self.emg.device)
            moved[name] = value + shift.reshape(-1, *(1,) * axes)
        return self.with_params(moved), nudges
