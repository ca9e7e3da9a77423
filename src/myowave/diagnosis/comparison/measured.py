"""A fitted model along the measured motion: the one place where the comparisons meet trials, records and the physics.

Shapes: T trials, N samples, D points in a sample step, M muscles, K numbers of the state, R restarts, L steps.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.signal import savgol_coeffs, savgol_filter
from torch import Tensor

from myowave.data.trials import Trials
from myowave.diagnosis.comparison.sensor import unobserve
from myowave.identification.record import make_record
from myowave.physics.drive import Drive
from myowave.physics.dynamics import observe, torques
from myowave.physics.effect import call
from myowave.physics.model import Model
from myowave.physics.motion import initial_state, step
from myowave.physics.simulation import Simulation

Array = NDArray[np.float64]

WIDEST_S = 0.35  # window of the local cubics that smooth the motion
SHORTEST = 5  # samples of it
TOO_SMOOTH = 1.1  # times the noise that smoothing may take away, in the root mean square


@dataclass(frozen=True)
class Fitted:
    """A model with values for what a fit has estimated; the rest is known of the trials, or at its default."""

    model: Model
    values: Mapping[str, float]

    @property
    def name(self) -> str:
        return self.model.name


@dataclass(frozen=True)
class Measured:
    """The measured motion of all trials, and its smoothed state.

    Args:
        angle: as recorded [rad], (T, N).
        q, qdot: smoothed by local cubics [rad, rad/s], (T, N).
        emg: one channel per muscle, (T, N, M).
        known: constants and conditions, name -> (T,).
        sway: how far the upper arm's lean is from the known `tilt` over time [rad], (T, N); None where nobody measured.
        lengths: recorded samples of each trial.
        training: which trials may be fitted, (T,).
        noise: standard deviation of the noise of the angle [rad].
        window: samples of the local cubics.
    """

    names: tuple[str, ...]
    dt: float
    angle: Array
    q: Array
    qdot: Array
    emg: Tensor
    known: Mapping[str, Tensor]
    lengths: tuple[int, ...]
    training: NDArray[np.bool_]
    noise: float
    window: int
    sway: Tensor | None = None

    @classmethod
    def of(cls, trials: Trials, base: Model, noise_deg: float) -> "Measured":
        """All trials of a dataset.

        Args:
            base: whose muscles say which channels are needed.
        """
        record = make_record(trials, base, noise_deg)
        training = [trials.angle[i, :length] for i, length in enumerate(trials.lengths) if record.training[i]]
        window = choose_window(training, record.dt, record.noise)
        q, qdot = smooth(record.angle, trials.lengths, record.dt, window)
        return cls(
            names=record.names,
            dt=record.dt,
            angle=record.angle,
            q=q,
            qdot=qdot,
            emg=record.emg,
            known=record.known,
            lengths=trials.lengths,
            training=record.training,
            noise=record.noise,
            window=window,
            sway=record.sway,
        )

    def between(self, values: Array, points: Array, order: int) -> Array:
        """Values (T, N) at points (D,) within every sample step, (T, N - 1, D), by splines of an order.

        The steps beyond a trial's end hold 0.
        """
        fine = np.zeros((len(values), values.shape[1] - 1, len(points)))
        for trial, length in enumerate(self.lengths):
            if length > order:
                at = (np.arange(length - 1)[:, None] + points).ravel()
                spline = make_interp_spline(np.arange(length), values[trial, :length], k=order)
                fine[trial, : length - 1] = spline(at).reshape(length - 1, -1)
        return fine


def choose_window(angles: Sequence[Array], dt: float, noise: float) -> int:
    """Samples of the widest window of local cubics that takes no more than noise out of the angles.

    A wide window rounds off a quick motion, a narrow one keeps the noise, above all in the velocity.

    Args:
        angles: of trials, (N_i,) each [rad].
        noise: standard deviation of their noise [rad].
    """
    most = min(round(WIDEST_S / dt), *(len(angle) for angle in angles))
    for window in range(most - (most % 2 == 0), SHORTEST, -2):
        left = np.concatenate([angle - savgol_filter(angle, window, 3, mode="interp") for angle in angles])
        own = savgol_coeffs(window, 3)[window // 2]  # how much of its own noise a smoothed sample keeps
        if np.sqrt((left**2).mean()) <= TOO_SMOOTH * noise * np.sqrt(1 - own):
            return window
    return SHORTEST


def smooth(angle: Array, lengths: Sequence[int], dt: float, window: int) -> tuple[Array, Array]:
    """Angle and velocity (T, N) of local cubics over `window` samples; held after a trial's end.

    A trial shorter than the window gets a shorter one, and one of fewer than five samples stays as it is.
    """
    q, qdot = angle.copy(), np.zeros_like(angle)
    for i, length in enumerate(lengths):
        width = min(window, length - (length % 2 == 0))
        if width >= SHORTEST:
            for order, target in ((0, q), (1, qdot)):
                values = savgol_filter(angle[i, :length], width, 3, deriv=order, delta=dt, mode="interp")
                target[i] = np.pad(values, (0, angle.shape[1] - length), mode="edge")
    return q, qdot


@dataclass(frozen=True, eq=False)
class Along:
    """A fitted model along the measured motion of all trials."""

    measured: Measured
    fitted: Fitted

    @cached_property
    def simulation(self) -> Simulation:
        m = self.measured
        return Simulation(self.fitted.model, {**m.known, **self.fitted.values}, m.emg, m.dt, sway=m.sway)

    @cached_property
    def motion(self) -> tuple[Array, Array, Array]:
        """The joint's angle, unsmoothed and smoothed, and its velocity (T, N): those whose observation is the measured
        angle, if the model has effects on the sensor."""
        m, model = self.measured, self.fitted.model
        if not model.on("observation"):
            return m.angle, m.q, m.qdot

        def sensor(q: Array, qdot: Array) -> Array:
            angle, velocity = (torch.from_numpy(np.ascontiguousarray(x)) for x in (q, qdot))
            seen: Array = observe(self.simulation.along_time, angle, velocity, m.dt).numpy()
            return seen

        smoother = partial(smooth, lengths=m.lengths, dt=m.dt, window=m.window)
        angle = unobserve(sensor, smoother, m.angle, m.lengths, m.dt)
        return angle, *smoother(angle)

    @cached_property
    def state(self) -> Tensor:
        """State (T, N, K) along the motion. States of effects start at rest with the trial and follow it, so that a
        muscle that has worked is tired."""
        _, q, qdot = self.motion
        q, qdot = torch.from_numpy(q), torch.from_numpy(qdot)
        joint = torch.stack([q, qdot], -1)
        if not self.fitted.model.stateful:
            return joint
        simulation = self.simulation
        states = [initial_state(simulation, q[:, 0], qdot[:, 0])]
        for n in range(q.shape[-1] - 1):
            after = step(simulation.valued, states[-1], simulation.drive.at(n))
            states.append(torch.cat([joint[:, n + 1], after[:, 2:]], -1))
        return torch.stack(states, -2)

    def torques(self, points: Array) -> tuple[Array, Array, Array]:
        """Torque of the muscles and of effects, torque of gravity [N m], and moment of inertia [kg m^2].

        Args:
            points: within a sample step, as fractions of it, (D,).

        Returns:
            Three arrays (T, N - 1, D); what overflows is not finite.
        """
        m, model, valued = self.measured, self.fitted.model, self.simulation.along_time
        shape = (len(m.names), m.angle.shape[1] - 1, len(points))
        position = torch.arange(shape[1], dtype=torch.float64)[:, None, None] + torch.from_numpy(points)[:, None]
        drive = [x.expand(*shape, -1).flatten(1, 2) for x in self.simulation.activate(position)]
        excitation, activation = drive
        _, q, qdot = (torch.from_numpy(m.between(x, points, 3)).flatten(1) for x in self.motion)
        states = self._states_between(points)
        for effect in model.late_activation:
            quantities = {"excitation": excitation, "activation": activation, "side": valued.muscle["side"]}
            if effect.stateful:
                quantities["state"] = states[effect.name]
            activation = call(effect.function, quantities, valued.values(effect))
        sway = self.simulation.sway_at(position)
        leaning = valued if sway is None else valued.leaning(sway.flatten(1, 2))
        result = torques(leaning, q, qdot, activation, states)
        parts = (result.muscles + result.effects, result.gravity, result.inertia)
        given, gravity, inertia = (x.expand_as(q).reshape(shape).numpy() for x in parts)
        return given, gravity, inertia

    def activations(self, points: Array) -> Array:
        """Delayed activation of every muscle, (T, N - 1, D, M), before effects with states."""
        steps = self.measured.angle.shape[1] - 1
        position = torch.arange(steps, dtype=torch.float64)[:, None, None] + torch.from_numpy(points)[:, None]
        _, activation = self.simulation.activate(position)
        return activation.expand(len(self.measured.names), -1, -1, -1).numpy()

    def _states_between(self, points: Array) -> dict[str, Tensor]:
        """States of effects by name, (T, (N - 1) D, M), linear between samples."""
        model, width = self.fitted.model, len(self.fitted.model.muscles)
        if not model.stateful:
            return {}
        left, right = self.state[:, :-1, None], self.state[:, 1:, None]
        fine = (left + torch.from_numpy(points)[:, None] * (right - left)).flatten(1, 2)
        return {e.name: fine[..., 2 + i * width : 2 + (i + 1) * width] for i, e in enumerate(model.stateful)}

    def predict(self, trial: NDArray[np.int64], start: NDArray[np.int64], steps: int) -> Array:
        """Angle as the sensor sees it, simulated from the state at samples of the measured motion [rad].

        The EMG that drives it is that of the whole trial, so the muscles know what came before the restart.

        Args:
            trial, start: of each restart, (R,).
            steps: L; those beyond a trial's end mean nothing.

        Returns:
            (R, L + 1), from the restart on; not finite where the motion diverges.
        """
        m, drive = self.measured, self.simulation.drive
        known = {name: values[trial] for name, values in m.known.items()}
        restarted = Simulation(self.fitted.model, {**known, **self.fitted.values}, m.emg[trial, :2], m.dt)
        shape = (len(m.names), *drive.activation.shape[-3:])
        excitation, activation = (x.expand(shape) for x in (drive.excitation, drive.activation))
        pieces = drive.pieces.expand(len(m.names), 1, -1)[trial].squeeze(-2)
        states = [self.state[trial, start]]
        for n in range(steps):
            at = np.minimum(start + n, shape[1] - 1)
            sway = None if drive.sway is None else drive.sway[trial, at]
            now = Drive(excitation[trial, at], activation[trial, at], pieces, sway)
            states.append(step(restarted.valued, states[-1], now))
        q, qdot = torch.stack(states, -2)[..., :2].unbind(-1)
        return observe(restarted.along_time, q, qdot, m.dt).numpy()
