"""What the windows of two groups of trials show, with a change in the second group: torques and activations.

Shapes: T trials, K windows, L windows of all trials one after the other, C electrodes, M muscles, B copies.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from myowave.data.trials import Array
from myowave.identification.along import Along
from myowave.identification.record import Record
from myowave.identification.torque import TorqueBalance
from myowave.physics.constants import OVER_TIME
from myowave.physics.model import Model

BUMP_RAD = 0.01  # of the lean, for differences
TINY = 1e-12  # squared torque of muscles that give none [N^2 m^2]
NO_FORCE = -30.0  # logarithm of a factor on passive forces that leaves none


@dataclass(frozen=True)
class Windowed:
    """All windows of the trials, each trial's one after the other."""

    rows: tuple[slice, ...]  # where each trial's windows are, T of them; `time` of each window [s], (L,)
    time: Array
    # q, qdot: mean motion [rad, rad/s], (L,)
    q: Array
    qdot: Array
    # that the muscles have to give [N m], (L,): what the motion needs less what effects on the joint give
    torque: Array
    by_tilt: Array  # its derivative by the lean of the upper arm [N m/rad], and `read`, the measured lean [rad], (L,)
    read: Array
    activation: Array  # of each electrode's muscles (mean), (C, L)
    usual: Array  # the active torque of the model's muscles of each electrode, (C, L) [N m]
    # what usual errors of shape and delay of the muscles of each electrode do to it, (2 C, L) [N m]; none where nobody
    # asked
    by_drive: Array

    @property
    def sizes(self) -> Array:
        """Root mean square of the torque of each trial [N m], (T,)."""
        return np.sqrt([(self.torque[rows] ** 2).mean() for rows in self.rows])

    @property
    def strength(self) -> float:
        """What the usual torque of all muscles is to be multiplied by, at least 0."""
        # ASSUME: what makes all muscles of an arm stronger than usual is alike. A fit of each alone finds none in those
        # that work against the others, and what they do would be missing.
        usual = self.usual.sum(0)
        return max(float(usual @ self.torque / (usual @ usual).clip(TINY)), 0.0)

    @property
    def left(self) -> Array:
        """The torque that the usual muscles do not give [N m], (L,)."""
        return self.left_by(self.strength)

    def left_by(self, strength: float) -> Array:
        """The same where the usual torque is multiplied by this."""
        return self.torque - strength * self.usual.sum(0)

    @property
    def size(self) -> Array:
        """That of its trial at each window [N m], (L,)."""
        return np.repeat(self.sizes, [rows.stop - rows.start for rows in self.rows])


@dataclass(frozen=True)
class Groups:
    """Trials of two groups."""

    record: Record  # whole trials of both
    second: NDArray[np.bool_]  # which of them are of the second group, (T,)

    @property
    def known(self) -> dict[str, Array]:
        """Conditions that are known and differ between trials, by name, from 0 to 1 each, (T,)."""
        values = {name: of_trials.numpy() for name, of_trials in self.record.known.items()}
        return {name: (v - v.min()) / np.ptp(v) for name, v in values.items() if np.ptp(v) > 0}

    def take(self, trials: Sequence[int], second: Sequence[int]) -> "Groups":
        """Some of the trials, of which some others than now are the second group."""
        return Groups(self.record.take(list(trials)), np.isin(trials, second))

    def windows(self, model: Model, change: Mapping[str, Array], errors: Mapping[str, float] | None = None) -> Windowed:
        """What the windows show if parameters of a model have these values in each trial, (T,); with usual errors of
        `shape` and `delay` of muscles, where their derivatives are wanted. A ValueError if a trial is too short for a
        window."""
        record = self.record
        params: dict[str, Tensor] = {name: torch.from_numpy(values) for name, values in change.items()}
        balance = TorqueBalance.along(Along(model, record, params if model.on("observation") else {}))
        # ASSUME: windows that overlap are no samples; those that only touch are.
        every = 2 * balance.windows.half // balance.windows.stride
        inside = balance.inside & (np.arange(balance.inside.shape[1]) % every == 0)
        if not inside.any(-1).all():
            short = ", ".join(name for name, some in zip(record.names, inside.any(-1), strict=True) if not some)
            raise ValueError(f"trials {short} are too short for a window; name longer ones")
        counts = np.cumsum(inside.sum(-1))
        rows = tuple(slice(int(end - n), int(end)) for end, n in zip(counts, inside.sum(-1), strict=True))
        tilt = record.known.get("tilt", torch.zeros(len(record.names), dtype=torch.float64))
        errors = errors or {}
        found = balance.torques({**params, **self._copies(model, tilt, errors)})
        needed, given, effects = (
            np.broadcast_to(x, (len(found.given), *inside.shape))[:, inside]
            for x in (found.needed, found.given, found.effects)
        )
        count = len(electrodes(model))
        muscles = (given - effects)[2:].reshape(1 + len(errors), count, -1)
        _, activation = record.simulation(model, params).activate(balance.position)
        activation = balance.mean(activation.expand(*balance.q.shape, -1))[inside].T
        channels = np.array([m.channel for m in model.muscles])
        mean = balance.mean(torch.stack([balance.q, balance.qdot, self._lean(balance, tilt)], -1))[inside]
        torque = needed - effects
        return Windowed(
            rows=rows,
            time=np.nonzero(inside)[1].astype(float) * balance.windows.stride * balance.windows.dt,
            q=mean[:, 0],
            qdot=mean[:, 1],
            torque=torque[0],
            by_tilt=(torque[1] - torque[0]) / BUMP_RAD,
            read=mean[:, 2],
            activation=np.stack([activation[channels == c].mean(0) for c in electrodes(model)]),
            usual=muscles[0],
            by_drive=(muscles[1:] - muscles[0]).reshape(-1, len(mean)),
        )

    def _copies(self, model: Model, tilt: Tensor, errors: Mapping[str, float]) -> dict[str, Tensor]:
        """Values (B, 1) or (B, T) of constants for copies of the trials: as it is and with the arm leaning more, both
        without muscles; then with the muscles of one electrode after the other, as they are and with each error of
        theirs. No muscle has a passive force."""
        channels = electrodes(model)
        copies = 2 + (1 + len(errors)) * len(channels)
        leaning = torch.zeros(copies, 1, dtype=torch.float64)
        leaning[1] = BUMP_RAD
        values = {"passive_curve": torch.tensor(NO_FORCE, dtype=torch.float64), "tilt": tilt + leaning}
        for m in model.muscles:
            place = 2 + channels.index(m.channel)
            force = torch.zeros(copies, 1, dtype=torch.float64)
            force[place :: len(channels)] = m.nominal["f0"]
            force[:2] = 0.0
            values[f"f0_{m.name}"] = force
            for k, (name, error) in enumerate(errors.items(), 1):
                value = torch.full((copies, 1), m.nominal[name], dtype=torch.float64)
                value[place + k * len(channels)] += error
                values[f"{name}_{m.name}"] = value
        return values

    def _lean(self, balance: TorqueBalance, tilt: Tensor) -> Tensor:
        """The measured lean of the upper arm at every point [rad], (T, n, D)."""
        course = balance.record.simulation(balance.model, {}).course_at(balance.position)
        level = tilt[:, None, None].expand(balance.q.shape)
        return level if course is None else level + course[..., OVER_TIME.index("tilt")]


def electrodes(model: Model) -> tuple[str, ...]:
    """Channels of a model's muscles, each once."""
    return tuple(dict.fromkeys(m.channel for m in model.muscles))
