"""All that may have made the residual of a fit to motion, as components of one likelihood.

The residual is taken in cosine waves: white noise stays white, and what physics misses is in the slow ones. Waves well
above the motion are counted one by one; they tell how strong the noise is, and whether a filter has taken it.

Shapes: T trials (or pieces), N samples, K numbers of the state, M muscles, W waves of a trial, L values of all trials.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from myowave.diagnosis.likelihood.algebra import COST, Component, Residual
from myowave.diagnosis.likelihood.sensor import Sensor, with_memory
from myowave.diagnosis.misfit.own_curves import pushes_of_curves
from myowave.diagnosis.misfit.repeated import along_steps, correcting_pushes
from myowave.diagnosis.misfit.size import size_of_misfit
from myowave.diagnosis.misfit.terms import OF_SENSOR
from myowave.identification.disturbance import excitation_forcing, forcing_by
from myowave.identification.free_parameters import Free, scales
from myowave.identification.least_squares import scaled_slope
from myowave.identification.noise import SMALLEST_NOISE_DEG
from myowave.identification.output_error import Fit
from myowave.identification.spectrum import answers
from myowave.identification.whitening import START_DEG, START_DEG_S, MotionBand
from myowave.physics.effects.constant_torque import EFFECT as CONSTANT_TORQUE
from myowave.physics.trajectory import recur

Array = NDArray[np.float64]

# ASSUME: constants of which nothing is known are known up to a factor of e or so, in units of their scale.
WIDE = 1.0
MEMORY_S = 0.3  # ASSUME: a torque that nobody recorded stays alike for so long
REACH = 3.0  # how far waves are dense, in units of the motion's edge: an arm follows nothing much faster
MOST, MOST_ABOVE = 110, 250  # waves of a trial in the band and above: more tell nothing of what is slow
STARTS = np.array([np.radians(START_DEG), np.radians(START_DEG_S)])
MEMORIES_S = (0.05, 0.1, 0.2, 0.4, 0.8)  # of the sensor's noise, which are tried

NOISE, EMG, CURVES, REPEATS, SLOW = "noise", "emg", "curves", "repeats", "slow"
COLOURED, DRIFT, GAINS, TISSUE = "coloured", "drift", "gains", "tissue"
# Bounds of sizes and where their search starts: rad; of the EMG; standard bumps; rad of each part; N m; rad; s/s; a
# share; rad.
SIZES = {
    NOISE: (1e-5, 1e-2, 0.3),
    EMG: (1e-3, 0.03, 0.6),
    CURVES: (0.03, 0.3, 6.0),
    REPEATS: (1e-5, 0.02, 1.0),
    SLOW: (1e-3, 0.3, 30.0),
    COLOURED: (1e-4, 1e-2, 0.3),
    DRIFT: (1e-4, 3e-3, 0.1),
    GAINS: (1e-3, 0.05, 0.6),
    TISSUE: (1e-3, 0.03, 0.6),
}


@dataclass(frozen=True)
class View:
    """How trials are looked at: waves of each, and what a sensor makes of them.

    Args:
        band, above: waves of each trial in the band and of those above, T of (N_t, W_t).
        frequency: of those in the band [Hz], T of (W_t,).
        sensor: of the angle.
        edge_hz: where the band of the motion ends.
        memory_s: of the noise that the sensor may have beside the white one.
    """

    band: tuple[Array, ...]
    above: tuple[Array, ...]
    frequency: tuple[Array, ...]
    frequency_above: tuple[Array, ...]
    sensor: Sensor
    edge_hz: float
    memory_s: float = MEMORIES_S[2]

    @classmethod
    def of(cls, fit: Fit, sensor: Sensor | None = None) -> "View":
        """That of a fit's trials."""
        record = fit.record
        edge, dt = size_of_misfit(replace(fit, record=replace(record, filter=None))).edge_hz, record.dt
        longest = int(record.lengths.max())
        top = min(max(REACH * edge, 1.0) * dt, MOST / (2 * longest), 0.5)
        whole = MotionBand.of(record.valid, 0.5)
        band, above, low, high = [], [], [], []
        for t, n in enumerate(record.lengths):
            waves, frequency = whole.waves[t, :n], whole.frequency[t]
            live = (waves != 0).any(0)
            inside = live & (frequency <= top)
            beyond = np.flatnonzero(live & (frequency > top))
            chosen = beyond[:: max(1, -(-len(beyond) // MOST_ABOVE))]
            band.append(waves[:, inside])
            above.append(waves[:, chosen])
            low.append(frequency[inside] / dt)
            high.append(frequency[chosen] / dt)
        return cls(tuple(band), tuple(above), tuple(low), tuple(high), sensor or Sensor(), edge)


class Looking:
    """Signals of a record's trials in the waves of a view; built once for each sensor."""

    def __init__(self, view: View, dt: float) -> None:
        self.view, self.dt = view, dt
        seen = [view.sensor.seen(waves, dt) for waves in view.band]
        high = [view.sensor.seen(waves, dt) for waves in view.above]
        self.waves, self.of_noise = zip(*seen, strict=True)
        self.high, self.of_noise_high = zip(*high, strict=True)

    def amplitudes(self, columns: Array) -> Array:
        """Of the waves in simulated columns (T, N, C) as the sensor sees them, (L, C)."""
        return np.concatenate([w.T @ x[: len(w)] for w, x in zip(self.waves, columns, strict=True)])

    def left(self, fit: Fit) -> Array:
        """Measured less simulated angle, (L,)."""
        return np.concatenate([*self._left(fit, self.view.band, self.waves)])

    def left_above(self, fit: Fit) -> Array:
        """The same above the band, (H,)."""
        return np.concatenate([*self._left(fit, self.view.above, self.high)])

    def _left(self, fit: Fit, waves: Sequence[Array], seen: Sequence[Array]) -> list[Array]:
        rows = zip(waves, seen, fit.record.angle, fit.angle, strict=True)
        return [w.T @ measured[: len(w)] - s.T @ simulated[: len(w)] for w, s, measured, simulated in rows]

    def remembering(self, memory_s: float) -> "Looking":
        """The same with another memory of the sensor's noise."""
        other = copy(self)
        other.view = replace(self.view, memory_s=memory_s)
        return other

    def split(self, values: Array) -> tuple[Array, ...]:
        """What is known of all values, (L,), trial by trial."""
        return tuple(np.split(values, np.cumsum([w.shape[1] for w in self.waves])[:-1]))

    @property
    def both(self) -> Array:
        """All waves as the sensor sees them, those of the band first, padded: (T, N, most of a trial)."""
        parts = [np.concatenate(pair, 1) for pair in zip(self.waves, self.high, strict=True)]
        found = np.zeros((len(parts), max(len(p) for p in parts), max(p.shape[1] for p in parts)))
        for t, part in enumerate(parts):
            found[t, : part.shape[0], : part.shape[1]] = part
        return found


@dataclass(frozen=True)
class Pushes:
    """What moves the arm of a fit beside what its model knows, whatever the sensor: changes of the state in a step.

    Args:
        excitation: by 1 more in each muscle's excitation, (T, N - 1, K, M), and `torque`, by 1 N m, (T, N - 1, K, 1).
        repeating: by each part of the general correction, and `curves`, by each bump, as angles (T, N, C).
    """

    excitation: Array
    torque: Array
    repeating: Array
    curves: Array

    @classmethod
    def of(cls, fit: Fit) -> "Pushes":
        jacobian = fit.linear.jacobian

        def moved(pushes: Array) -> Array:
            start = jacobian.new_zeros(*jacobian.shape[:-3], jacobian.shape[-1], pushes.shape[-1])
            answer: Tensor = recur(jacobian, torch.from_numpy(pushes), start)[..., 0, :]
            return answer.numpy() * fit.record.valid[..., None]

        repeating = np.stack([*correcting_pushes(fit).values()], -1)
        curves = pushes_of_curves(fit)
        both = moved(np.concatenate([repeating, curves], -1))
        count = repeating.shape[-1]
        torque = forcing_by(fit, CONSTANT_TORQUE)
        return cls(excitation_forcing(fit), torque, both[..., :count], both[..., count:])


def residual_of(fit: Fit, looking: Looking, pushes: Pushes | None = None) -> Residual:
    """What a fit leaves, and all that may have made it.

    Args:
        pushes: of the fit, where they are known.
    """
    record, dt = fit.record, fit.record.dt
    look, pushes = looking.amplitudes, pushes or Pushes.of(fit)
    constants, off = prior_columns(fit, looking)
    jacobian, forcing = fit.linear.jacobian, pushes.excitation
    both = np.concatenate([forcing, pushes.torque], -1)
    steps = np.stack([*answers(jacobian.numpy(), both, looking.both)])[::-1]  # (N - 1, T, M + 1, W + H)
    widths = [(b.shape[1], a.shape[1]) for b, a in zip(looking.waves, looking.high, strict=True)]
    by_emg = [_within(steps[:, t, :-1], w, h) for t, (w, h) in enumerate(widths)]
    by_torque = [_within(steps[:, t, -1], w, h) for t, (w, h) in enumerate(widths)]
    excitation = fit.simulation.drive.excitation[..., 0, :].expand(*forcing.shape[:2], -1).numpy()
    by_gain = [np.einsum("nmw,nm->mw", each, excitation[t]) for t, each in enumerate(by_emg)]
    eyes = tuple(np.eye(w) for w, _ in widths)
    count = sum(h for _, h in widths)
    starts = looking.amplitudes(scaled_slope(fit.sensitive.by_start, 1.0, record.valid)) * STARTS
    start_parts = np.split(starts, np.cumsum([w for w, _ in widths])[:-1])
    floor = float(np.radians(SMALLEST_NOISE_DEG))
    components = [
        Component("floor", eyes, tail=np.ones(count), low=floor, first=floor, high=floor),
        Component("starts", tuple(s @ s.T for s in start_parts)),
        Component("constants", columns=constants),
        _sized(NOISE, *_blocks(looking.of_noise, looking.of_noise_high), cost=0.0),
        _forced(EMG, by_emg, widths),
        _sized(SLOW, *_slow(by_torque, widths, dt)),
        _sized(REPEATS, columns=_repeating(fit, looking, look(pushes.repeating))),
        _sized(CURVES, columns=look(pushes.curves)),
    ]
    if record.pieces is None:
        _, v, activation = along_steps(fit)
        time = np.arange(record.angle.shape[1]) * dt
        drifting = fit.sensitive.motion.state[..., 1].numpy() * time * record.valid
        last = activation[:, -1:]
        artefact = torch.cat([activation, last], 1).numpy() * record.valid[..., None]
        components += [
            coloured(looking),
            _sized(DRIFT, columns=look(drifting[..., None])),
            _forced(GAINS, by_gain, widths),
            _sized(TISSUE, columns=look(artefact)),
        ]
    values = looking.left(fit) + constants @ off
    return Residual(looking.split(values), tuple(components), looking.left_above(fit))


def prior_columns(fit: Fit, looking: Looking) -> tuple[Array, Array]:
    """What one standard deviation of what is known of each free parameter does, (L, P), and by how many of them it is
    above where it is expected, (P,)."""
    deviation, centre = prior_of(fit)
    slope = looking.amplitudes(scaled_slope(fit.sensitive.by_parameter, scales(fit.free), fit.record.valid))
    return slope * deviation, (fit.values / scales(fit.free) - centre) / deviation


def prior_of(fit: Fit) -> tuple[Array, Array]:
    """Standard deviation of each free parameter before any trial and where it is expected, in its scale, (P,) each;
    one of which nothing is known about where it stands, that of an effect about 0."""
    deviation = [WIDE if is_of_effect(p) else min(p.deviation / p.scale, WIDE) for p in fit.free]
    centre = [
        0.0 if is_of_effect(p) else (p.start if np.isfinite(p.deviation) else value) / p.scale
        for p, value in zip(fit.free, fit.values, strict=True)
    ]
    return np.array(deviation), np.array(centre)


def is_of_effect(free: Free) -> bool:
    return "." in free.name


def coloured(looking: Looking, memory_s: float | None = None) -> Component:
    """Noise of the sensor with a memory, as it is before any filter."""
    view = looking.view
    memory_s = view.memory_s if memory_s is None else memory_s
    blocks = tuple(with_memory(w, looking.dt, memory_s) for w in looking.waves)
    tail = np.concatenate([np.diag(with_memory(w, looking.dt, memory_s)) for w in looking.high])
    return _sized(COLOURED, blocks, tail)


def _sized(
    name: str,
    blocks: tuple[Array, ...] = (),
    tail: Array | None = None,
    columns: Array | None = None,
    cost: float = COST,
) -> Component:
    low, first, high = SIZES[name]
    return Component(name, blocks, columns, tail, low, first, high, cost)


def _within(steps: Array, waves: int, above: int) -> Array:
    """Answers to the steps of one trial without what is padded."""
    return steps[..., : waves + above]


def _forced(name: str, answers_of: Sequence[Array], widths: Sequence[tuple[int, int]]) -> Component:
    """Independent pushes, whose answers (..., W + H) are known for each trial."""
    flat = [a.reshape(-1, a.shape[-1]) for a in answers_of]
    blocks = tuple(a[:, :w].T @ a[:, :w] for a, (w, _) in zip(flat, widths, strict=True))
    return _sized(
        name, blocks, np.concatenate([(a[:, w:] ** 2).sum(0) for a, (w, _) in zip(flat, widths, strict=True)])
    )


def _slow(answers_of: Sequence[Array], widths: Sequence[tuple[int, int]], dt: float) -> tuple[tuple[Array, ...], Array]:
    """Covariances of pushes that stay alike for a while, and variances above the band."""
    blocks, tail = [], []
    for a, (w, _) in zip(answers_of, widths, strict=True):
        width = MEMORY_S / dt
        alike = gaussian_filter1d(a, width, axis=0, mode="constant", truncate=5.0) * np.sqrt(2 * np.pi) * width
        blocks.append(a[:, :w].T @ alike[:, :w])
        blocks[-1] = (blocks[-1] + blocks[-1].T) / 2
        tail.append((a[:, w:] * alike[:, w:]).sum(0).clip(0.0))
    return tuple(blocks), np.concatenate(tail)


def _blocks(waves: Sequence[Array], high: Sequence[Array]) -> tuple[tuple[Array, ...], Array]:
    return tuple(w.T @ w for w in waves), np.concatenate([(w**2).sum(0) for w in high])


def _repeating(fit: Fit, looking: Looking, by_pushes: Array) -> Array:
    """What each part of the general correction does, a root mean square of 1 rad each, (L, C)."""
    q, v = fit.sensitive.motion.state[..., :2].unbind(-1)
    parts = np.stack([term(q, v).numpy() for term, _ in OF_SENSOR.values()], -1) * fit.record.valid[..., None]
    columns = np.concatenate([by_pushes, looking.amplitudes(parts)], -1)
    return columns / np.sqrt((columns**2).sum(0) / fit.record.samples).clip(1e-300)
