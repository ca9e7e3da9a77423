"""An arm of another simulator: formulas, path and integrator of its own, nothing of `myowave.physics`.

Shapes: T trials, N samples; muscles are biceps and triceps.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.integrate import solve_ivp

from myowave.data.simulate import ANGLE_RANGE, synthetic_emg
from myowave.data.trials import Array, Trials
from myowave.settings import SimulatedDataset

EFFECTS = ("joint_damping", "gravity_tilt", "emg_crosstalk", "joint_stiffness", "constant_torque", "observation_lag")
GRAVITY, REST = 9.80665, 1.0  # rest of the joint's stiffness [rad], which is a convention
MOST_DRAWS = 4
CHANNELS = ("emg_biceps", "emg_triceps")


class Moves(Protocol):
    """An arm of any simulator."""

    def moved(self, value: Mapping[str, float], emg: Array, dt: float, start_rad: float) -> Array:
        """See `Arm.moved`."""


@dataclass(frozen=True)
class Arm:
    """Two muscles and a forearm; what is drawn is within what anatomy and published curves allow."""

    width: float  # of the active force-length curve exp(-|(l^skew - 1) / width|^roundness)
    skew: float
    roundness: float
    onset: float  # of the passive force stiffness (l - onset)^2
    stiffness: float
    bend: float  # of the force-velocity hyperbola, and the force where a muscle lengthens fast
    eccentric: float
    shape: float  # s of the activation a = (1 + s) u / (1 + s u)
    arms: Array  # moment arm of each muscle as a parabola in the angle [m], (2, 3)
    offset: Array  # length of each muscle with a straight arm [m], (2,)
    delay: Array  # of each muscle [s], (2,)
    mass: float  # of the forearm [kg]

    FORCE = np.array([300.0, 300.0])
    FIBRE = np.array([0.6, 0.4])
    FASTEST = np.array([6.0, 4.0])
    TENDON = np.array([0.55, 0.33])

    @classmethod
    def draw(cls, random: np.random.Generator) -> "Arm":
        """An arm near that of the paper's Table 1."""
        # Moment arms: parabolas nearest to those of straight lines over the hinge, with other insertions.
        angle = np.linspace(0.0, 1.9, 100)
        lines, lengths = [], []
        for near, far, side in ((0.3, 0.8, 1.0), (0.2, 0.7, -1.0)):
            near, far = near * random.normal(1, 0.03), far * random.normal(1, 0.03)
            length = np.sqrt(near**2 + far**2 + 2 * side * near * far * np.cos(angle))
            parabola = np.polyfit(angle, side * near * far * np.sin(angle) / length, 2)[::-1]
            lines.append(parabola)
            lengths.append((length + _integral(parabola, angle)).mean())
        return cls(
            width=random.uniform(0.38, 0.5),
            skew=random.uniform(0.85, 1.15),
            roundness=random.uniform(1.8, 2.4),
            onset=random.uniform(0.95, 1.1),
            stiffness=random.uniform(0.5, 2.0),
            bend=random.uniform(0.2, 0.33),
            eccentric=random.uniform(1.3, 1.5),
            shape=random.uniform(-0.25, 0.0),
            arms=np.array(lines),
            offset=np.array(lengths),
            delay=0.08 + 0.005 * random.standard_normal(2),
            mass=random.normal(1, 0.03),
        )

    def torque(self, angle: Array, velocity: Array, drive: Array) -> Array:
        """Torque of the muscles [N m], (T,), at angle and velocity (T,) and delayed EMG (T, 2)."""
        q = angle[:, None]
        arm = self.arms[:, 0] + self.arms[:, 1] * q + self.arms[:, 2] * q**2
        length = (self.offset - np.stack([_integral(a, angle) for a in self.arms], -1) - self.TENDON) / self.FIBRE
        speed = (-arm * velocity[:, None] / self.FASTEST).clip(-1.0, None)
        active = np.exp(-(np.abs((length.clip(1e-3) ** self.skew - 1) / self.width) ** self.roundness))
        passive = self.stiffness * (length - self.onset).clip(0.0) ** 2
        slope = 2 * (1 + 1 / self.bend)  # twice as steep where a muscle begins to lengthen
        shortening = (1 + speed.clip(None, 0)) / (1 - speed.clip(None, 0) / self.bend)
        gained = (self.eccentric - 1) * slope * speed / (self.eccentric - 1 + slope * speed.clip(0))
        force = np.where(speed < 0, shortening, 1 + gained)
        activation = (1 + self.shape) * drive / (1 + self.shape * drive)
        return np.asarray((self.FORCE * arm * (activation * active * force + passive)).sum(-1))

    def moved(self, value: Mapping[str, float], emg: Array, dt: float, start_rad: float) -> Array:
        """The angle that an observer sees [rad], (T, N), from the muscles' own EMG (T, N, 2), straight between samples.

        Args:
            value: of the parameters of some of `EFFECTS`, by full name.
        """
        trials, samples = emg.shape[:2]
        time = np.arange(samples) * dt

        def drive(at: float) -> Array:
            position = ((at - self.delay) / dt).clip(0, samples - 1.001)
            left = position.astype(int)
            share = position - left
            both = np.arange(2)
            return np.asarray(emg[:, left, both] * (1 - share) + emg[:, left + 1, both] * share)

        def change(at: float, state: Array) -> Array:
            angle, velocity, seen = state.reshape(3, trials)
            torque = self.torque(angle, velocity, drive(at)) - self.mass * GRAVITY * np.sin(
                angle + value.get("gravity_tilt.phi", 0.0)
            )
            torque += value.get("constant_torque.tau", 0.0) - value.get("joint_damping.c", 0.0) * velocity
            torque -= value.get("joint_stiffness.k", 0.0) * (angle - REST)
            lag = value.get("observation_lag.tau", 0.0)
            return np.concatenate([velocity, torque / self.mass, (angle - seen) / lag if lag else velocity])

        state = np.concatenate([np.full(trials, start_rad), np.zeros(trials), np.full(trials, start_rad)])
        solved = solve_ivp(change, (0.0, time[-1]), state, "DOP853", time, rtol=1e-4, atol=1e-5)
        return np.asarray(solved.y[2 * trials :]) if solved.success else np.full((trials, samples), np.nan)


def make_trials(arm: Moves, value: Mapping[str, float], seed: int, like: SimulatedDataset) -> Trials | None:
    """Trials with noise of the EMG that drives the arm; None where no draw keeps it in range. Where there is crosstalk,
    each electrode reports a share of the other muscle too, in units of its own maximum.

    Args:
        value: see `Arm.moved`.
        like: says how many trials and how long they are.
    """
    shape = (like.trials, like.samples)
    emg, angle = np.empty((*shape, 2)), np.full(shape, np.nan)
    for draw in range(MOST_DRAWS):
        out = np.flatnonzero(~((angle > ANGLE_RANGE[0]) & (angle < ANGLE_RANGE[1])).all(1))
        if not len(out):
            names = tuple(str(i + 1) for i in range(like.trials))
            lengths = (like.samples,) * like.trials
            share = value.get("emg_crosstalk.x", 0.0)
            heard = (emg + share * emg[..., ::-1]) / (1 + share)
            return Trials(f"arm{seed}", like.dt_s, names, CHANNELS, heard, angle, lengths, like.test)
        drawn = synthetic_emg(seed, trials=like.trials, samples=like.samples, dt=like.dt_s, draw=draw)
        drawn += like.emg_noise * np.random.default_rng([seed, draw]).standard_normal(drawn.shape)
        emg[out] = drawn.clip(0.0, 1.0)[out]
        angle[out] = arm.moved(value, emg[out], like.dt_s, like.start_rad)
    return None


def _integral(parabola: Array, angle: Array) -> Array:
    """Of a moment arm from 0 to an angle: how much shorter the muscle is there than with a straight arm."""
    a, b, c = parabola
    return np.asarray(a * angle + b * angle**2 / 2 + c * angle**3 / 3)
