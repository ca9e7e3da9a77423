"""What a motion follows from, but for where it starts: a model, values of its parameters, and the EMG that drives it.

From EMG to activation are Eqs. 1-2. EMG is linear between samples, so activation has a kink where a sample, shifted by
the muscle's delay, falls inside a step. A step is split at those kinks and each piece is one or more Runge-Kutta steps:
fourth order on noisy EMG too.

Shapes: ... batch, T trials, N samples, n positions, D points within a step, S pieces of a step, M muscles, P
parameters.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import torch
from torch import Tensor

from myowave.physics.model import Model, Params
from myowave.physics.muscle import activation as activation_of
from myowave.physics.valued import Valued, along, give_values


@dataclass(frozen=True)
class Instant:
    """A model with its values at one time, and excitation and activation there, (..., M); the activation is that before
    effects that have states."""

    valued: Valued
    excitation: Tensor
    activation: Tensor


@dataclass(frozen=True)
class Drive:
    """What drives the muscles, at the points of every step: beginning, middle and end of each of its S pieces."""

    # excitation, activation: (..., T, N - 1, 2 S + 1, M); activation before effects that have states
    excitation: Tensor
    activation: Tensor
    pieces: Tensor  # length of each piece [s], (..., T, 1, S)
    # how far the constants `OVER_TIME` are from their values for the trial, (..., T, N - 1, 2 S + 1, V); None where
    # they stay there
    course: Tensor | None = None

    def part(self, steps: slice | int) -> "Drive":
        """The drive of some of the steps; of one, without the axis of samples."""
        pieces = self.pieces.squeeze(-2) if isinstance(steps, int) else self.pieces
        course = None if self.course is None else self.course[..., steps, :, :]
        return Drive(self.excitation[..., steps, :, :], self.activation[..., steps, :, :], pieces, course)

    @property
    def at_samples(self) -> tuple[Tensor, Tensor]:
        """Excitation and activation at every sample, where steps begin and the last one ends, (..., T, N, M) each."""
        u, a = (torch.cat([x[..., 0, :], x[..., -1:, -1, :]], -2) for x in (self.excitation, self.activation))
        return u, a

    def instants(self, valued: Valued) -> list[Instant]:
        """Each of the 2 S + 1 points, with what is known over time there."""
        known = [None] * self.activation.shape[-2] if self.course is None else self.course.unbind(-2)
        points = zip(known, self.excitation.unbind(-2), self.activation.unbind(-2), strict=True)
        return [Instant(valued.timed(change), u, a) for change, u, a in points]


@dataclass(frozen=True, eq=False)
class Simulation:
    """A model, ready to be simulated. Parameters get values and the drive is made once, when first needed.

    Args:
        params: values by name, each broadcastable to (..., T); the rest take the model's defaults.
        emg: one channel per muscle, (..., T, N, M), every `dt` seconds; see `channels_of`.
        dt: sampling interval [s].
        substeps: Runge-Kutta steps for each piece between two kinks of the activation.
        lead: samples of EMG before the first sample of the motion, for muscles that answer late.
        course: how far the first V of the constants `OVER_TIME` are from their values for the trial at every sample of
            the motion, (..., T, N - lead, V); None where they stay there.
        begin: when the motion begins, after its trial does [s], broadcastable to (..., T).
    """

    model: Model
    params: Params
    emg: Tensor
    dt: float
    substeps: int = 1
    lead: int = 0
    course: Tensor | None = None
    begin: Tensor | float = 0.0

    @cached_property
    def valued(self) -> Valued:
        """The model with values for all its parameters."""
        return self.valued_along(0)

    @cached_property
    def along_time(self) -> Valued:
        """The same, broadcastable to quantities (..., T, N)."""
        return self.valued_along(1)

    def valued_along(self, axes: int) -> Valued:
        """The same, broadcastable to quantities with more axes (time, points) behind the trials."""
        return give_values(self.model, along(self.params, axes, self.emg), self.emg)

    @cached_property
    def breakpoints(self) -> Tensor:
        """Where a step is split, as fractions of it: (..., T, S + 1) from 0 to 1, S pieces between the kinks."""
        phase = torch.frac(self.valued.muscle["delay"] / self.dt)
        if bool((phase == phase[..., :1]).all()):
            phase = phase[..., :1]
        if bool((phase < 1e-12).all()):
            phase = phase[..., :0]
        ends = phase.new_zeros(*phase.shape[:-1], 1)
        kinks = torch.cat([ends, phase.sort(dim=-1).values, ends + 1.0], dim=-1)
        inner = torch.arange(self.substeps, dtype=phase.dtype, device=phase.device) / self.substeps
        split = kinks[..., :-1, None] + torch.diff(kinks, dim=-1)[..., None] * inner
        return torch.cat([split.flatten(-2), ends + 1.0], dim=-1)

    @cached_property
    def drive(self) -> Drive:
        """Excitation and activation of every muscle, and what is known over time, at the points of every step."""
        return self._drive_from(0, self.emg.shape[-2] - 1 - self.lead)

    @cached_property
    def drive_before(self) -> Drive:
        """The same for the `lead` before the motion."""
        return self._drive_from(-self.lead, 0)

    def _drive_from(self, first: int, last: int) -> Drive:
        """The drive of some steps, that from the first sample of the motion being 0."""
        split = self.breakpoints
        middle = (split[..., :-1] + split[..., 1:]) / 2
        points = torch.cat([torch.stack([split[..., :-1], middle], -1).flatten(-2), split[..., -1:]], -1)
        step = torch.arange(first, last, dtype=split.dtype, device=split.device)
        position = step[:, None, None] + points[..., None, :, None]
        pieces = (torch.diff(split, dim=-1) * self.dt).unsqueeze(-2)
        return Drive(*self.activate(position), pieces, self.course_at(position))

    def activate(self, position: Tensor) -> tuple[Tensor, Tensor]:
        """Excitation u(t) = e(t - delay) and activation at positions in samples of the motion (..., T, n, D, 1), each
        (..., T, n, D, M).

        Effects that act on the excitation, and those on the activation that come before one with a state, are in it.

        Source: Taneja et al. 2023, Eqs. 1-2.
        """
        # ASSUME: a negative sample of EMG counts as 0 (a muscle cannot push), in generation and identification alike.
        # ASSUME: EMG is linear between samples; before the first sample it holds the first value.
        valued = self.valued_along(2)
        side = valued.muscle["side"]
        position = position + self.lead - valued.muscle["delay"] / self.dt
        excitation = between_samples(self.emg.clamp(min=0.0), position)
        # As in `muscle_quantities`: time runs fastest in memory, then trials, points within a step, muscles.
        excitation = excitation.movedim((-1, -2), (0, 1)).contiguous().movedim((0, 1), (-1, -2))
        for effect in valued.acting["excitation"]:
            excitation = effect({"excitation": excitation, "side": side})
        activation = activation_of(excitation, valued.muscle["shape"])
        for effect in valued.acting["early_activation"]:
            activation = effect({"excitation": excitation, "activation": activation, "side": side})
        return excitation, activation

    def course_at(self, position: Tensor) -> Tensor | None:
        """What is known over time at such positions, as `course`: (..., T, n, D, V)."""
        return None if self.course is None else between_samples(self.course, position)

    def batch_shape(self, *starts: Tensor) -> torch.Size:
        """The shape (..., T) that EMG, parameters and values at the first sample broadcast to."""
        return torch.broadcast_shapes(
            self.emg.shape[:-2], *(torch.as_tensor(value).shape for value in (*self.params.values(), *starts))
        )

    def with_params(self, params: Params) -> "Simulation":
        """The same with other values for some parameters; it shares the drive if none of them changes it."""
        changed = replace(self, params={**self.params, **params})
        if not any(self.model.drives(name) for name in params):
            kept = {name: value for name, value in vars(self).items() if name in ("drive", "drive_before")}
            vars(changed).update(kept)  # where a cached property keeps its value
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
        nudges = reach * torch.tensor([*wrt.values()], dtype=self.emg.dtype, device=self.emg.device)
        values = along({name: self.params.get(name, self.model.defaults[name]) for name in wrt}, 0, self.emg)
        shifts = torch.diag(nudges).reshape(len(wrt), len(wrt), *(1,) * axes)
        return self.with_params({name: values[name] + shift for name, shift in zip(wrt, shifts, strict=True)}), nudges


def between_samples(values: Tensor, position: Tensor) -> Tensor:
    """Values of samples (..., T, N, M), linear between them and constant beyond.

    Args:
        position: in units of samples, (..., T, n, D, M).
    """
    samples = values.shape[-2]
    position = position.clamp(0.0, samples - 1.0)
    flat = position.flatten(-3, -2)
    before = flat.floor().clamp(max=max(samples - 2.0, 0.0))
    axes = max(values.dim(), flat.dim())  # take_along_dim broadcasts, but only among equally many axes
    values, index = values[(None,) * (axes - values.dim())], before.long()[(None,) * (axes - flat.dim())]
    left = torch.take_along_dim(values, index, dim=-2)
    right = torch.take_along_dim(values, (index + 1).clamp(max=samples - 1), dim=-2)
    return (left + (flat - before) * (right - left)).unflatten(-2, position.shape[-3:-1])


def channel_delays(model: Model, channels: Sequence[str]) -> tuple[float, ...]:
    """Delay of the muscles that each channel drives [s]; 0 for a channel that drives none."""
    # ASSUME: muscles that share an electrode answer after the same time; the first of them counts.
    return tuple(model.leading[c].nominal["delay"] if c in model.leading else 0.0 for c in channels)


def channels_of(model: Model, channels: tuple[str, ...], emg: Tensor) -> Tensor:
    """EMG with one entry per muscle, (..., T, N, M), from recorded channels (..., T, N, C).

    Raises:
        ValueError: if a muscle's channel was not recorded.
    """
    if missing := [f"{m.channel} (muscle {m.name})" for m in model.muscles if m.channel not in channels]:
        raise ValueError(
            f"the recording has no channel {', '.join(missing)}; it has {', '.join(channels)}. "
            "Correct the muscle's emg in its arm, or add the column."
        )
    return emg[..., [channels.index(m.channel) for m in model.muscles]]
