"""A model along the measured motion of whole trials: the state there, and predictions that start from it.

Shapes: T trials, N samples, K numbers of the state, R restarts, L steps.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.sparse.linalg import LinearOperator, gmres
from torch import Tensor

from myowave.data.trials import Array
from myowave.identification.record import Record
from myowave.physics.model import Model, Params
from myowave.physics.motion import initial_state, observe, step, walk
from myowave.physics.simulation import Simulation

Index = NDArray[np.int64]

CORRECTIONS = 8  # directions in which what a sensor does beyond an offset, a factor and a delay is corrected for


@dataclass(frozen=True, eq=False)
class Along:
    """A model with values of its parameters along the measured motion of all trials."""

    model: Model
    record: Record  # whole trials
    params: Params  # what a fit has estimated; the rest is known of the trials, or at its default
    sensor_time: bool = False  # whether the motion is told at the times when a sensor that is late reports it

    @cached_property
    def simulation(self) -> Simulation:
        assert self.record.pieces is None
        return self.record.simulation(self.model, self.params)

    @cached_property
    def motion(self) -> tuple[Array, Array, Array]:
        """The joint's angle, unsmoothed and smoothed, and its velocity (T, N): those whose observation is the measured
        angle, if the model has effects on the sensor."""
        if self.model.places["observation"]:
            angle = self._behind_sensor()
            return angle, *self.record.smoothed(angle)
        q, qdot = self.record.motion.numpy().transpose(2, 0, 1)
        return self.record.angle, q, qdot

    def _behind_sensor(self) -> Array:
        """Angle of the joint [rad], (T, N), that a sensor reports as the measured one.

        To first order a sensor is an offset, a factor and a delay; what it does to an arm at rest and to a steady
        motion tells these three. They are inverted, and what is left beyond the noise is corrected for by what leaves
        least in a Krylov space, as a series of corrections would diverge above the resonance of a mount. The measured
        angle as it is if the sensor has no inverse.

        Source: Saad & Schultz 1986, SIAM J. Sci. Stat. Comput. 7, 856 (GMRES).
        """
        record = self.record
        if not (np.abs(self.factor) > 0).all():
            return record.angle
        reported = (record.angle - self._offset) / self.factor
        moved = self._time - self.late  # when the joint did what is reported; what it did outside a trial nobody knows
        known = record.valid & (moved >= 0) & (moved <= (record.lengths[:, None] - 1) * record.dt)

        def seen(reported: Array) -> Array:
            """In units of what is reported, nothing where that is unknown, (T N,)."""
            found = self._seen(*record.smoothed(self._later(reported.reshape(known.shape), self.late)))
            return np.where(known, found / self.factor, 0.0).ravel()

        first = seen(reported)
        left = np.where(known, record.motion[..., 0].numpy() / self.factor, 0.0).ravel() - first
        # ASSUME: what is left is so small that a sensor adds it up.
        answer = LinearOperator((left.size, left.size), lambda more: seen(reported.ravel() + more) - first, dtype=float)
        if np.isfinite(left).all():
            noise = np.linalg.norm(np.where(known, record.motion_error[0] / self.factor, 0.0))
            corrected, _ = gmres(answer, left, rtol=0.0, atol=noise, restart=CORRECTIONS, maxiter=1)
            reported = reported + corrected.reshape(known.shape)
        joint = self._later(reported, self.late)
        if not np.isfinite(joint).all():
            return record.angle
        return reported if self.sensor_time else joint

    @cached_property
    def factor(self) -> Array:
        """What a sensor reports of an angle of 1 beyond what it reports of 0, (T, N)."""
        return self._at_rest(1.0) - self._offset

    @cached_property
    def late(self) -> Array:
        """How much later than the joint moves a sensor reports it, (T, N) [s]."""
        slow = self._seen(self._time, np.ones_like(self._time))
        return self._time - (slow - self._offset) / self.factor

    @cached_property
    def _offset(self) -> Array:
        """What a sensor reports of an angle of 0, (T, N)."""
        return self._at_rest(0.0)

    @property
    def _time(self) -> Array:
        """Of the samples, (T, N) [s]."""
        return np.tile(np.arange(self.record.angle.shape[1]) * self.record.dt, (len(self.record.angle), 1))

    def _at_rest(self, q: float) -> Array:
        """What the sensor reports of an arm that rests at an angle, (T, N)."""
        return self._seen(np.full_like(self.record.angle, q), np.zeros_like(self.record.angle))

    def _seen(self, q: Array, qdot: Array) -> Array:
        """What the sensor reports of a motion of the joint, (T, N) each."""
        angle, velocity = (torch.from_numpy(np.ascontiguousarray(x)) for x in (q, qdot))
        return observe(self.simulation, angle, velocity).numpy()

    def _later(self, values: Array, ahead: Array) -> Array:
        """values(t + ahead), (T, N), cubic between samples, straight beyond the ends of a trial."""
        if not ahead.any():
            return values
        moved, slope = values.copy(), self.record.smoothed(values)[1]
        for i, length in enumerate(self.record.lengths):
            time = np.arange(length) * self.record.dt
            at = time + ahead[i, :length]
            inside = at.clip(0.0, time[-1])
            edge = np.where(at < inside, slope[i, 0], slope[i, length - 1])
            curve = make_interp_spline(time, values[i, :length], k=3, check_finite=False)  # its caller looks
            moved[i, :length] = curve(inside) + (at - inside) * edge
            moved[i, length:] = moved[i, length - 1]
        return moved

    @cached_property
    def state(self) -> Tensor:
        """State (T, N, K) along the motion. States of effects start at rest with the trial and follow it, so that a
        muscle that has worked is tired."""
        _, q, qdot = (torch.from_numpy(np.ascontiguousarray(x)) for x in self.motion)
        joint = torch.stack([q, qdot], -1)
        if not self.model.stateful:
            return joint
        simulation = self.simulation
        states = [initial_state(simulation, q[:, 0], qdot[:, 0])]
        for n in range(q.shape[-1] - 1):
            after = step(simulation.valued, states[-1], simulation.drive.part(n))
            states.append(torch.cat([joint[:, n + 1], after[:, 2:]], -1))
        return torch.stack(states, -2)

    def predict(self, trial: Index, start: Index, steps: int) -> Array:
        """Angle as the sensor sees it, simulated from the state at samples of the measured motion [rad].

        Args:
            trial, start: of each restart, (R,).
            steps: L; those beyond a trial's end mean nothing.

        Returns:
            (R, L + 1), from the restart on; not finite where the motion diverges.
        """
        part = self.record.stretches(trial, start, steps + 1)
        return walk(part.simulation(self.model, self.params), self.state[trial, start]).angle.numpy()
