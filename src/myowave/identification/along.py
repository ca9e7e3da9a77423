"""A model along the measured motion of whole trials: the state there, and predictions that start from it.

Shapes: T trials, N samples, K numbers of the state, R restarts, L steps.
"""

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from myowave.identification.record import Record
from myowave.identification.sensor import unobserve
from myowave.identification.smoothing import smooth
from myowave.physics.drive import Drive
from myowave.physics.model import Model, Params
from myowave.physics.motion import initial_state, observe, step
from myowave.physics.simulation import Simulation

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Along:
    """A model with values of its parameters along the measured motion of all trials.

    Args:
        record: whole trials.
        params: what a fit has estimated; the rest is known of the trials, or at its default.
    """

    model: Model
    record: Record
    params: Params

    @cached_property
    def simulation(self) -> Simulation:
        assert self.record.pieces is None
        return self.record.simulation(self.model, self.params)

    @cached_property
    def motion(self) -> tuple[Array, Array, Array]:
        """The joint's angle, unsmoothed and smoothed, and its velocity (T, N): those whose observation is the measured
        angle, if the model has effects on the sensor."""
        record = self.record
        if not self.model.on("observation"):
            q, qdot = record.motion.numpy().transpose(2, 0, 1)
            return record.angle, q, qdot

        def sensor(q: Array, qdot: Array) -> Array:
            angle, velocity = (torch.from_numpy(np.ascontiguousarray(x)) for x in (q, qdot))
            seen: Array = observe(self.simulation.along_time, angle, velocity, record.dt).numpy()
            return seen

        smoother = partial(smooth, lengths=record.lengths, dt=record.dt, window=record.window)
        angle = unobserve(sensor, smoother, record.angle, record.lengths, record.dt)
        return angle, *smoother(angle)

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
            after = step(simulation.valued, states[-1], simulation.drive.at(n))
            states.append(torch.cat([joint[:, n + 1], after[:, 2:]], -1))
        return torch.stack(states, -2)

    def predict(self, trial: Index, start: Index, steps: int) -> Array:
        """Angle as the sensor sees it, simulated from the state at samples of the measured motion [rad].

        The EMG that drives it is that of the whole trial, so the muscles know what came before the restart.

        Args:
            trial, start: of each restart, (R,).
            steps: L; those beyond a trial's end mean nothing.

        Returns:
            (R, L + 1), from the restart on; not finite where the motion diverges.
        """
        record, drive = self.record, self.simulation.drive
        known = {name: values[trial] for name, values in record.known.items()}
        restarted = Simulation(self.model, {**known, **self.params}, record.emg[trial, :2], record.dt)
        shape = (len(record.names), *drive.activation.shape[-3:])
        excitation, activation = (x.expand(shape) for x in (drive.excitation, drive.activation))
        pieces = drive.pieces.expand(len(record.names), 1, -1)[trial].squeeze(-2)
        states = [self.state[trial, start]]
        for n in range(steps):
            at = np.minimum(start + n, shape[1] - 1)
            course = None if drive.course is None else drive.course[trial, at]
            now = Drive(excitation[trial, at], activation[trial, at], pieces, course)
            states.append(step(restarted.valued, states[-1], now))
        q, qdot = torch.stack(states, -2)[..., :2].unbind(-1)
        return observe(restarted.along_time, q, qdot, record.dt).numpy()
