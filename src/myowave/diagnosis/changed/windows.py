"""What the windows of two groups of trials show, with a change in the second group: torques and activations.

Shapes: T trials, K windows, L windows of all trials one after the other, C electrodes, M muscles, B copies, E errors.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.linalg.lapack import dpstrf
from torch import Tensor

from myowave.data.trials import Array
from myowave.identification.along import Along
from myowave.identification.free_parameters import deviation_of
from myowave.identification.record import Record
from myowave.identification.torque import TorqueBalance
from myowave.physics.constants import OVER_TIME
from myowave.physics.effect import Effect
from myowave.physics.model import Model
from myowave.settings import Scatter

BUMP_RAD = 0.01  # of the lean, for differences
TINY = 1e-12  # squared torque of muscles that give none [N^2 m^2]
NO_FORCE = -30.0  # logarithm of a factor on passive forces that leaves none
# ASSUME: moment arm times force changes over as much of angle [rad] and velocity [rad/s] as curves of the arm's muscles
# do: over an elbow's range they are near to parabolas (Murray et al. 1995; Hill 1938).
SMOOTH_RAD, SMOOTH_RAD_S = 1.2, 4.0
UNTOLD = 1e-6  # variance, of 1, that the directions kept of such functions need not hold


@dataclass(frozen=True, eq=False)
class Kinematics:
    """How the arm moves in all windows of the trials, each trial's one after the other."""

    counts: NDArray[np.int64]  # windows of each trial, (T,)
    time: Array  # of each window [s], (L,)
    mean: Array  # angle [rad], velocity [rad/s] and measured lean of the upper arm [rad], (3, L)
    # log of how much farther apart motions of the joint are than what a sensor reports of them, of each trial, (T,):
    # where it exaggerates, errors of the torque seem smaller [nats]
    spread: Array

    def padded(self, values: Array) -> Tensor:
        """Values (L, ...) trial by trial, (T, most windows of a trial, ...), 0 where a trial has no more."""
        parts = torch.from_numpy(np.ascontiguousarray(values)).split(self.counts.tolist())
        return torch.nn.utils.rnn.pad_sequence(parts, batch_first=True)

    @cached_property
    def smooth(self) -> Array:
        """Directions of smooth functions of angle and velocity at the windows, of variance 1, (L, ...)."""
        q, qdot = self.mean[0] / SMOOTH_RAD, self.mean[1] / SMOOTH_RAD_S
        kernel = np.exp(-((q[:, None] - q) ** 2 + (qdot[:, None] - qdot) ** 2) / 2)
        # They are few: a triangular root of the kernel ends with them, long before all of its directions are known.
        root, order, rank, _ = dpstrf(kernel, tol=UNTOLD, lower=1)
        columns = np.empty((len(q), rank))
        columns[order - 1] = np.tril(root)[:, :rank]
        return columns


@dataclass(frozen=True, eq=False)
class Moving:
    """What windows are taken from, whatever drives the joint."""

    balance: TorqueBalance
    inside: NDArray[np.bool_]  # which of its windows count, (T, K)
    motion: Kinematics  # at the times when a sensor that is late reports it
    late: Array  # how much later that is in each trial, (T,) [s]

    @classmethod
    def along(cls, model: Model, record: Record, params: Mapping[str, Tensor]) -> "Moving":
        """Raises a ValueError if a trial is too short for a window."""
        # At other times each window would look at other samples of what a late sensor reports.
        along = Along(model, record, params, sensor_time=True)
        balance = TorqueBalance.along(along)
        # ASSUME: windows that overlap are no samples; those that only touch are.
        every = -(-2 * balance.windows.half // balance.windows.stride)
        inside = balance.inside & (np.arange(balance.inside.shape[1]) % every == 0)
        if not inside.any(-1).all():
            short = ", ".join(name for name, some in zip(record.names, inside.any(-1), strict=True) if not some)
            raise ValueError(f"trials {short} are too short for a window; name longer ones")
        course = record.simulation(model, {}).course_at(balance.position)
        lean = tilt_of(record)[:, None, None].expand(balance.q.shape)
        lean = lean if course is None else lean + course[..., OVER_TIME.index("tilt")]
        mean = balance.mean(torch.stack([balance.q, balance.qdot, lean], -1))[inside].T
        stride_s = balance.windows.stride * balance.windows.dt
        counts, time = inside.sum(-1), np.nonzero(inside)[1].astype(float) * stride_s
        spread = (-np.log(np.abs(along.factor))).mean(1)
        return cls(balance, inside, Kinematics(counts, time, mean, counts * spread), along.late.mean(1))

    def torques(self, model: Model, params: Mapping[str, Tensor]) -> tuple[Array, Array, Array]:
        """What copies (B, 1) or (B, T) of a model's constants need of muscles and what these give [N m], and the moment
        of inertia [kg m^2], (B, L) each; what effects on the joint give muscles need not."""
        found = replace(self.balance, model=model).torques(params)
        parts = found.needed - found.effects, found.given - found.effects, found.inertia
        shape = len(found.given), *self.inside.shape
        needed, given, inertia = (np.broadcast_to(x, shape)[:, self.inside] for x in parts)
        return needed, given, inertia


def tilt_of(record: Record) -> Tensor:
    """What is known of the lean of the upper arm in each trial [rad], (T,)."""
    return record.known.get("tilt", torch.zeros(len(record.names), dtype=torch.float64))


@dataclass(frozen=True)
class Windowed:
    """What the windows show."""

    motion: Kinematics
    # that the muscles have to give [N m], (L,): what the motion needs less what effects on the joint give
    torque: Array
    by_tilt: Array  # its derivative by the lean of the upper arm [N m/rad], (L,)
    inertia: Array  # moment of inertia about the joint [kg m^2], (L,)
    activation: Array  # of each electrode's muscles (mean), (C, L)
    usual: Array  # the active torque of the model's muscles of each electrode, (C, L) [N m]
    by_errors: Array  # what usual errors of the muscles do to torque, whatever has changed, (2 C, L) [N m]

    def but_one(self, other: "Windowed", trial: int) -> "Windowed":
        """The same, but for a trial, of which others show what they do."""
        motion, theirs = self.motion, other.motion
        mine = np.repeat(np.arange(len(motion.counts)) != trial, motion.counts)
        if theirs is not motion:
            spread = np.where(np.arange(len(motion.counts)) != trial, motion.spread, theirs.spread)
            motion = replace(motion, mean=np.where(mine, motion.mean, theirs.mean), spread=spread)
        names = "torque", "by_tilt", "inertia", "activation", "usual"
        each = {name: np.where(mine, getattr(self, name), getattr(other, name)) for name in names}
        return replace(self, motion=motion, **each)

    @property
    def sizes(self) -> Array:
        """Root mean square of the torque of each trial [N m], (T,)."""
        return np.asarray(np.sqrt(self.motion.padded(self.torque**2).sum(1).numpy() / self.motion.counts))

    @property
    def density(self) -> Array:
        """Log density of the measured motion of each trial over that of its torque, up to a constant, (T,) [nats]."""
        return np.asarray(self.motion.padded(np.log(self.inertia)).sum(1).numpy() + self.motion.spread)

    @property
    def strength(self) -> float:
        """What the usual torque of all muscles is to be multiplied by, at least 0."""
        # ASSUME: what makes all muscles of an arm stronger than usual is alike. A fit of each alone finds none in those
        # that work against the others, and what they do would be missing.
        usual = self.usual.sum(0)
        return max(float(usual @ self.torque / (usual @ usual).clip(TINY)), 0.0)

    def left_by(self, strength: float) -> Array:
        """The torque that the usual muscles do not give if theirs is multiplied by this [N m], (L,)."""
        return self.torque - strength * self.usual.sum(0)


@dataclass(frozen=True)
class Groups:
    """Trials of two groups."""

    record: Record  # whole trials of both
    second: NDArray[np.bool_]  # which of them are of the second group, (T,)
    base: Model
    scatter: Mapping[str, Scatter]  # standard deviations of what nobody measured

    @property
    def known(self) -> dict[str, Array]:
        """Conditions that are known and differ between trials, by name, from 0 to 1 each, (T,)."""
        values = {name: of_trials.numpy() for name, of_trials in self.record.known.items()}
        return {name: (v - v.min()) / np.ptp(v) for name, v in values.items() if np.ptp(v) > 0}

    def take(self, trials: Sequence[int], second: Sequence[int]) -> "Groups":
        """Some of the trials, of which some others than now are the second group."""
        return replace(self, record=self.record.take(list(trials)), second=np.isin(trials, second))

    @cached_property
    def moving(self) -> Moving:
        """The motion where nothing has changed; raises a ValueError if a trial is too short for a window."""
        return Moving.along(self.base, self.record, {})

    @cached_property
    def plain(self) -> Windowed:
        """What the windows show there."""
        return self._seen_by(self.moving, self.base, {})

    def windows(self, effect: Effect, names: Sequence[str], values: Array) -> Windowed:
        """The same if parameters of an effect have a value in each trial, (T,); what it leaves as it is stays."""
        model, plain = self.base.with_effects([effect]), self.plain
        params = dict.fromkeys(names, torch.from_numpy(values))
        if effect.acts_on == "observation":
            return self._seen_by(Moving.along(model, self.record, params), model, params)
        if effect.acts_on == "joint" or not effect.needs_muscles:
            torque, by_tilt, inertia = self._of_joint(self.moving, model, params)
            return replace(plain, torque=torque, by_tilt=by_tilt, inertia=inertia)
        activation, usual = self._of_muscles(self.moving, model, params)
        return replace(plain, activation=activation, usual=usual)

    @cached_property
    def by_errors(self) -> Array:
        """What usual errors of `shape` and `delay` of the muscles of each electrode do to torque, (2 C, L) [N m]."""
        errors = {
            constant: {
                m.name: deviation_of(f"{constant}_{m.name}", m.nominal[constant], self.scatter)
                for m in self.base.muscles
            }
            for constant in ("shape", "delay")
        }
        muscles = self._by_electrode(self.moving, self.base, {}, errors)
        return (muscles[1:] - muscles[0]).reshape(-1, muscles.shape[-1])

    def _seen_by(self, moving: Moving, model: Model, params: Mapping[str, Tensor]) -> Windowed:
        parts = *self._of_joint(moving, model, params), *self._of_muscles(moving, model, params)
        return Windowed(moving.motion, *parts, self.by_errors)

    def _of_joint(self, moving: Moving, model: Model, params: Mapping[str, Tensor]) -> tuple[Array, Array, Array]:
        """Its torque, the derivative and inertia, from the arm as it is and leaning more, both without muscles."""
        leaning = torch.tensor([[0.0], [BUMP_RAD]], dtype=torch.float64)
        muscles = model.muscles if any(effect.needs_muscles for effect in model.effects) else ()
        bare, record = replace(model, muscles=muscles), self.record
        known = {name: values for name, values in record.known.items() if name in bare.defaults}
        balance = replace(moving.balance, record=replace(record, emg=record.emg[..., : len(muscles)], known=known))
        without = {f"f0_{m.name}": torch.zeros(1, 1, dtype=torch.float64) for m in muscles}
        params = {**params, **without, "tilt": tilt_of(record) + leaning}
        torque, _, inertia = replace(moving, balance=balance).torques(bare, params)
        return torque[0], (torque[1] - torque[0]) / BUMP_RAD, inertia[0]

    def _of_muscles(self, moving: Moving, model: Model, params: Mapping[str, Tensor]) -> tuple[Array, Array]:
        """Activation and usual torque."""
        balance = moving.balance
        late = {f"delay_{m.name}": torch.from_numpy(m.nominal["delay"] + moving.late) for m in model.muscles}
        params = {**params, **late}
        _, activation = self.record.simulation(model, params).activate(balance.position)
        activation = balance.mean(activation.expand(*balance.q.shape, -1))[moving.inside].T
        means = np.stack([activation[np.equal(model.electrodes, c)].mean(0) for c in range(len(model.channels))])
        return means, self._by_electrode(moving, model, params, {})[0]

    def _by_electrode(
        self, moving: Moving, model: Model, params: Mapping[str, Tensor], errors: Mapping[str, Mapping[str, float]]
    ) -> Array:
        """Torque of the muscles of one electrode after the other, as they are and with each error of a constant, by
        muscle, (1 + E, C, L); no muscle has a passive force."""
        count = len(model.channels)
        values = {"passive_curve": torch.tensor(NO_FORCE, dtype=torch.float64)}
        for place, m in zip(model.electrodes, model.muscles, strict=True):
            force = torch.zeros((1 + len(errors)) * count, 1, dtype=torch.float64)
            force[place::count] = m.nominal["f0"]
            values[f"f0_{m.name}"] = force
            for k, (constant, error) in enumerate(errors.items(), 1):
                value = torch.full_like(force, m.nominal[constant])
                value[place + k * count] += error[m.name]
                values[f"{constant}_{m.name}"] = value
        _, muscles, _ = moving.torques(model, {**params, **values})
        return muscles.reshape(1 + len(errors), count, -1)
