"""What a fit sees of the trials: tensors for the model, weights, known constants, the noise.

Shapes: T trials, N samples of the longest, M muscles.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs
from torch import Tensor

from myowave.data.processing.filters import HIGHEST
from myowave.data.trials import TORQUE, Trials
from myowave.identification.noise import noise_of
from myowave.identification.smoothing import SHORTEST, choose_window, smooth
from myowave.physics.constants import LATEST_S, OVER_TIME
from myowave.physics.model import Model, Params
from myowave.physics.simulation import Simulation, channels_of

# ASSUME: dry friction brakes a light machine by 10 rad/s^2 or so: in 10 ms by more than the 0.03 rad/s over which it
# grows, in this [s] by less.
MACHINE_STEP_S = 0.0025


@dataclass(frozen=True)
class Cut:
    """Where the pieces come from that trials were cut into."""

    whole: "Record"  # the trials
    row: NDArray[np.int64]  # the trial of each piece, (T,); the pieces of a trial are in the order of time
    horizon_s: float  # how long a piece is at least, but for trials that are shorter [s]


@dataclass(frozen=True)
class Record:
    """Trials of one subject as tensors, or pieces of trials that are predicted each from a start of its own."""

    names: tuple[str, ...]  # of the trial that each row is, or is a piece of, (T,)
    dt: float
    emg: Tensor  # one channel per muscle, (T, L + N, M), the first L before those of the motion
    angle: NDArray[np.float64]  # measured [rad], (T, N)
    valid: NDArray[np.bool_]  # False where a shorter trial is padded, (T, N)
    training: NDArray[np.bool_]  # which trials may be fitted, (T,)
    begin: NDArray[np.int64]  # the first sample of each row in its trial, (T,)
    known: dict[str, Tensor]  # constants that are known, each (T,): the conditions of the trials
    # standard deviation of the noise of the angle [rad]; what is known of constants beforehand weighs as much as
    # samples with it, and with what a model is known to miss
    noise: float
    window: int  # samples of the local cubics that smooth the motion, see `smoothing`
    missed: float = 0.0  # by a model, whatever its constants [rad]
    emg_noise: float = 0.0  # standard deviation of the noise behind which the EMG is the expected one; 0: as recorded
    # corner of the low-pass that the EMG has passed, and its noise with it; None where that is white
    emg_low_pass_hz: float | None = None
    lead: int = 0  # samples of EMG before the first of the motion, L; 0 for trials
    pieces: Cut | None = None  # None for whole trials
    # of the muscles as a dynamometer measured it [N m], NaN where none did, (T, N); None where none ever did
    torque: NDArray[np.float64] | None = None
    # how far the constants `OVER_TIME` are from what is known of them for the trial, (T, N, V); None where nobody
    # measured any over time
    course: Tensor | None = None

    @property
    def motor(self) -> Tensor | None:
        """Torque of the motor with the joint at rest as recorded [N m], (T, N); None where none was."""
        if self.course is None or "motor" not in self.known:
            return None
        return self.known["motor"][:, None] + self.course[..., OVER_TIME.index("motor")]

    @property
    def misfit(self) -> float:
        """Standard deviation of what no constants explain, noise and what a model misses [rad]."""
        return float(np.hypot(self.noise, self.missed))

    @property
    def whole(self) -> "Record":
        """The trials, whole."""
        return self if self.pieces is None else self.pieces.whole

    @property
    def begin_s(self) -> NDArray[np.float64]:
        """When each row begins in its trial [s], (T,)."""
        return np.multiply(self.begin, self.dt, dtype=np.float64)

    @property
    def horizon_s(self) -> float | None:
        """How far the motion is predicted from a start [s]; None: over whole trials."""
        return None if self.pieces is None else self.pieces.horizon_s

    def joined(self, values: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """What is known at every sample (T, N), without padding, the pieces of each trial one after the other."""
        parts: dict[str, list[NDArray[np.float64]]] = {}
        for name, row, valid in zip(self.names, values, self.valid, strict=True):
            parts.setdefault(name, []).append(row[valid])
        return {name: np.concatenate(rows) for name, rows in parts.items()}

    @property
    def samples(self) -> int:
        """Number of measured samples."""
        return int(self.valid.sum())

    @property
    def lengths(self) -> NDArray[np.int64]:
        """Measured samples of each trial, (T,)."""
        return self.valid.sum(1)

    @property
    def train(self) -> "Record":
        return self.take(np.flatnonzero(self.training))

    def take(self, index: Sequence[int] | NDArray[np.intp]) -> "Record":
        """Some of the trials; padding that all of them have is cut."""
        row, cut = np.asarray(index), self.pieces
        longest = int(self.lengths[row].max())
        return replace(
            self._part(row, np.arange(longest)[None], np.arange(self.lead + longest)[None]),
            names=tuple(self.names[i] for i in row),
            pieces=None if cut is None else replace(cut, row=cut.row[row]),
        )

    def cut(self, horizon_s: float) -> "Record":
        """The trials in pieces as long as a horizon, or a little longer, so that no short rest is left.

        Each piece has a start of its own.
        """
        # ASSUME: states of activation (a lag, fatigue) are at rest where the EMG before a piece begins, those of
        # tendons where the piece does.
        assert self.pieces is None, "the record is in pieces already"
        counts = np.maximum(1, (self.lengths * self.dt / horizon_s + 1e-9).astype(int))
        cuts = [np.linspace(0, n, k + 1).round().astype(int) for n, k in zip(self.lengths, counts, strict=True)]
        row = np.repeat(np.arange(len(cuts)), counts)
        begin, end = (np.concatenate([c[part] for c in cuts]) for part in (slice(None, -1), slice(1, None)))
        longest = int((end - begin).max())
        return replace(
            self.stretches(row, begin, longest, end - 1),
            names=tuple(self.names[i] for i in row),
            valid=np.arange(longest) < (end - begin)[:, None],
            pieces=Cut(self, row, horizon_s),
            torque=None,  # said once, of whole trials, by the fit to torque
        )

    def stretches(
        self, row: NDArray[np.intp], begin: NDArray[np.int64], samples: int, last: NDArray[np.int64] | None = None
    ) -> "Record":
        """Stretches of whole trials, with the EMG of `LATEST_S` before them, as muscles answer late.

        Args:
            row: the trial of each, (R,); `begin` is its first sample there, and what `last` has stays beyond that.
        """
        lead = round(LATEST_S / self.dt)
        last = self.angle.shape[1] - 1 if last is None else last[:, None]
        # As in whole trials, EMG before the first sample of a trial holds the first value.
        past = (begin[:, None] + np.arange(-lead, samples)).clip(0, last)
        return replace(self._part(row, past[:, lead:], past), begin=begin, lead=lead)

    def _part(self, row: NDArray[np.intp], sample: NDArray[np.intp], past: NDArray[np.intp]) -> "Record":
        """Some rows (R,) at some samples (R, n), with the EMG at others (R, L + n)."""
        at = row[:, None], sample
        return replace(
            self,
            emg=self.emg[row[:, None], past],
            angle=self.angle[at],
            valid=self.valid[at],
            training=self.training[row],
            begin=self.begin[row],
            known={name: values[row] for name, values in self.known.items()},
            torque=None if self.torque is None else self.torque[at],
            course=None if self.course is None else self.course[at],
        )

    def simulation(self, model: Model, params: Params) -> Simulation:
        """What simulates these trials with a model: their EMG, what is known of them, and other parameters."""
        steps = 1 if model.muscles else math.ceil(self.dt / MACHINE_STEP_S)
        begin_s = torch.from_numpy(self.begin_s)
        return Simulation(model, {**self.known, **params}, self.emg, self.dt, steps, self.lead, self.course, begin_s)

    @cached_property
    def motion(self) -> Tensor:
        """State (q, qdot) of the measured motion, smoothed, (T, N, 2)."""
        if self.pieces is not None:
            within = np.minimum(np.arange(self.angle.shape[1]), self.lengths[:, None] - 1)
            return self.whole.motion[self.pieces.row[:, None], self.begin[:, None] + within]
        return torch.from_numpy(np.stack(self.smoothed(self.angle), -1))

    @cached_property
    def start_error(self) -> NDArray[np.float64]:
        """Standard deviations of angle and velocity where each piece begins, as measured [rad, rad/s], (T, 2): of the
        noise that smoothing left, and of the motion that it took; infinite for whole trials, before which nothing was.
        """
        if self.pieces is None:
            return np.full((len(self.names), 2), np.inf)
        # ASSUME: half the window takes nothing of the motion, so what it finds otherwise was taken, but for noise.
        whole, narrow = self.whole, max(SHORTEST, self.window // 4 * 2 + 1)
        otherwise = np.stack(smooth(whole.angle, whole.lengths, self.dt, narrow), -1)
        taken = (whole.motion.numpy() - otherwise)[self.pieces.row, self.begin]
        errors = []
        for at_end in (True, False):
            wide = self._weights(at_end, self.window)
            noise, apart = (
                self.noise * np.linalg.norm(w, axis=1) for w in (wide, wide - self._weights(at_end, narrow))
            )
            errors.append(np.sqrt(noise**2 + np.maximum(taken**2 - apart**2, 0.0)))
        return np.where(self.begin[:, None] == 0, *errors)

    @property
    def motion_error(self) -> NDArray[np.float64]:
        """Standard deviations of the smoothed angle and its velocity within a trial, by noise [rad, rad/s], (2,)."""
        return self.noise * np.linalg.norm(self._weights(False, self.window), axis=1)

    def _weights(self, at_end: bool, width: int) -> NDArray[np.float64]:
        """Of samples in the smoothed angle and its velocity, at the first sample of a window of `width` or in its
        middle; 0 in the rest of the window that is used, (2, window)."""
        place, before = (0, 0) if at_end else (width // 2, (self.window - width) // 2)
        weights = [savgol_coeffs(width, 3, pos=place, use="dot", deriv=order, delta=self.dt) for order in (0, 1)]
        return np.pad(weights, ((0, 0), (before, self.window - width - before)))

    def smoothed(self, angle: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """An angle (T, N) [rad] along the trials without its noise, and its velocity [rad/s]."""
        return smooth(angle, self.lengths, self.dt, self.window)


def make_record(trials: Trials, model: Model, noise_deg: float | None = None) -> Record:
    """Tensors of all trials of a dataset.

    Args:
        model: whose muscles say which channels are needed.
        noise_deg: standard deviation of the noise of the angle; None estimates it from the training trials.
    """
    # ASSUME: noise behind a causal low-pass is like that behind one of phase zero with the same corner.
    corner = trials.emg_low_pass_hz
    train = trials.select(trials.train)
    recorded = [angle[:length] for angle, length in zip(train.angle, train.lengths, strict=True)]
    noise = noise_of(recorded, noise_deg)
    course = [trials.change_over_time(name) for name in OVER_TIME]
    still = np.zeros_like(trials.angle)
    return Record(
        names=trials.names,
        dt=trials.dt,
        emg=channels_of(model, trials.channels, torch.from_numpy(trials.emg)),
        angle=trials.angle,
        valid=trials.valid,
        training=np.array([name not in trials.test for name in trials.names]),
        begin=np.zeros(len(trials.names), dtype=np.int64),
        known={name: torch.from_numpy(values) for name, values in trials.known(model.defaults).items()},
        noise=noise,
        window=choose_window(recorded, trials.dt, noise),
        emg_low_pass_hz=corner if corner and corner * trials.dt < HIGHEST else None,
        torque=trials.signals.get(TORQUE),
        course=torch.from_numpy(np.stack([still if x is None else x for x in course], -1))
        if any(x is not None for x in course)
        else None,
    )
