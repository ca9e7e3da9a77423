"""From EMG to the activation of the muscles (Eqs. 1-2), at the points where the integrator needs it.

EMG is linear between samples, so activation has a kink where a sample, shifted by the muscle's delay, falls inside
a step. A step is split at those kinks and each piece is one or more Runge-Kutta steps: fourth order on noisy EMG too.

Shapes: ... batch, T trials, N samples, n positions, D points within a step, S pieces of a step, M muscles.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from myowave.physics.model import Model
from myowave.physics.muscle import activation as activation_of
from myowave.physics.valued import Valued


@dataclass(frozen=True)
class Drive:
    """What drives the muscles, at the points of every step: beginning, middle and end of each of its S pieces.

    Args:
        excitation, activation: (..., T, N - 1, 2 S + 1, M); activation before effects that have states.
        pieces: length of each piece [s], (..., T, 1, S).
        course: how far the constants `OVER_TIME` are from their values for the trial, (..., T, N - 1, 2 S + 1, V); None
            where they stay there.
    """

    excitation: Tensor
    activation: Tensor
    pieces: Tensor
    course: Tensor | None = None

    def at(self, n: int) -> "Drive":
        """The drive of step n only, without the axis of samples."""
        pieces = self.pieces.squeeze(-2)
        course = None if self.course is None else self.course[..., n, :, :]
        return Drive(self.excitation[..., n, :, :], self.activation[..., n, :, :], pieces, course)

    def part(self, steps: slice) -> "Drive":
        """The drive of some of the steps."""
        course = None if self.course is None else self.course[..., steps, :, :]
        excitation, activation = (x[..., steps, :, :] for x in (self.excitation, self.activation))
        return replace(self, excitation=excitation, activation=activation, course=course)

    def timed(self, valued: Valued) -> list[Valued]:
        """A model's values at each of the 2 S + 1 points, with what is known over time there."""
        if self.course is None:
            return [valued] * self.activation.shape[-2]
        return [valued.timed(change) for change in self.course.unbind(-2)]


def excite(emg: Tensor, delay: Tensor, position: Tensor, dt: float) -> Tensor:
    """Excitation u(t) = e(t - d) at positions within the record, Eq. 1.

    Args:
        emg: (..., T, N, M), the channel of each muscle [-], sampled every `dt` seconds.
        delay: (..., T, M) or (M,) [s].
        position: times in units of samples, (..., T, n, D, 1).

    Returns:
        (..., T, n, D, M).

    Source: Taneja et al. 2023, Eq. 1.
    """
    # ASSUME: a negative sample of EMG counts as 0 (a muscle cannot push), in generation and in identification alike.
    # ASSUME: EMG is linear between samples; before the first sample it holds the first value.
    return between_samples(emg.clamp(min=0.0), position - (delay / dt)[..., None, None, :])


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


def breakpoints(valued: Valued, dt: float, substeps: int) -> Tensor:
    """Where a step is split, as fractions of it: (..., T, S + 1) from 0 to 1, S pieces between the kinks."""
    phase = torch.frac(valued.driving["delay"] / dt)
    if bool((phase == phase[..., :1]).all()):
        phase = phase[..., :1]
    if bool((phase < 1e-12).all()):
        phase = phase[..., :0]
    ends = phase.new_zeros(*phase.shape[:-1], 1)
    kinks = torch.cat([ends, phase.sort(dim=-1).values, ends + 1.0], dim=-1)
    inner = torch.arange(substeps, dtype=phase.dtype, device=phase.device) / substeps
    split = kinks[..., :-1, None] + torch.diff(kinks, dim=-1)[..., None] * inner
    return torch.cat([split.flatten(-2), ends + 1.0], dim=-1)


def drive_muscles(
    valued: Valued, emg: Tensor, dt: float, substeps: int = 1, lead: int = 0, course: Tensor | None = None
) -> Drive:
    """Excitation and activation of every muscle, and what is known over time, at the points of every step.

    Args:
        valued: with `axes` 0.
        emg: channels as the muscles name them, (..., T, N, M).
        dt: sampling interval [s].
        substeps: Runge-Kutta steps for each piece between kinks.
        lead: samples of EMG before the first step.
        course: of the constants `OVER_TIME` at every sample of the motion, (..., T, N - lead, V).
    """
    split = breakpoints(valued, dt, substeps)
    middle = (split[..., :-1] + split[..., 1:]) / 2
    points = torch.cat([torch.stack([split[..., :-1], middle], -1).flatten(-2), split[..., -1:]], -1)
    start = torch.arange(lead, emg.shape[-2] - 1, dtype=emg.dtype, device=emg.device)
    position = start[:, None, None] + points[..., None, :, None]
    pieces = (torch.diff(split, dim=-1) * dt).unsqueeze(-2)
    excitation, activation = activate(valued, emg, position, dt)
    course = None if course is None else between_samples(course, position - lead)
    return Drive(excitation, activation, pieces, course)


def activate(valued: Valued, emg: Tensor, position: Tensor, dt: float) -> tuple[Tensor, Tensor]:
    """Excitation and activation (Eqs. 1-2) at positions (..., T, n, D, 1) in units of samples, each (..., T, n, D, M).

    Effects that act on the excitation, and those on the activation that come before one with a state, are in it.
    """
    raised = valued.along(2)
    side = raised.driving["side"]
    excitation = excite(emg, valued.driving["delay"], position, dt)
    # As in `muscle_quantities`: time runs fastest in memory, then trials, points within a step, muscles.
    excitation = excitation.movedim((-1, -2), (0, 1)).contiguous().movedim((0, 1), (-1, -2))
    for effect in raised.acting["excitation"]:
        excitation = effect({"excitation": excitation, "side": side})
    activation = activation_of(excitation, raised.driving["shape"])
    for effect in raised.acting["early_activation"]:
        activation = effect({"excitation": excitation, "activation": activation, "side": side})
    return excitation, activation


def channel_delays(model: Model, channels: Sequence[str]) -> tuple[float, ...]:
    """Delay of the muscles that each channel drives [s]; 0 for a channel that drives none."""
    # ASSUME: muscles that share an electrode answer after the same time; the first of them counts.
    delays = {m.channel: m.nominal["delay"] for m in reversed(model.muscles)}
    return tuple(delays.get(channel, 0.0) for channel in channels)


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
