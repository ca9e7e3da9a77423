"""Whether trials show an effect, to one who knows what was hidden and the covariance of the noise.

Shapes: T trials, N samples, R samples before a recorder took them at another rate.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
import torch
from numpy.typing import NDArray

from myowave.diagnosis.evidence import EVIDENCE
from myowave.diagnosis.search.score import score_effects
from myowave.identification.output_error import Fit, fit_from
from myowave.identification.record import Record
from myowave.identification.stages import attempt_fit
from myowave.identification.whitening import Filter
from myowave.physics.effect import Effect
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation
from studies.verdicts.worlds import Array, World, low_pass, resampled

POWER = 1.2816  # standard deviations above the threshold that 9 of 10 recordings reach
EMG_DRAWS = 300  # more than noise of the EMG has independent answers of the arm, some 60 in 16 s
FLOOR = 0.3  # of the angle's noise: no model of an arm is as exact as a filter's edge would let one see


def signals_of(
    hidden: Mapping[str, Mapping[str, float]],
    noise_deg: float,
    world: World,
    raw: tuple[int, float],
    fit: Fit,
    quiet: Record,
    catalogue: Mapping[str, Effect],
) -> dict[str, float]:
    """How far each hidden effect is above what 9 of 10 recordings would show: at least 1 for one that is [-].

    Args:
        hidden: effects with their parameters by short name.
        noise_deg: of the angle, white.
        raw: samples of a trial as simulated and the time between them [s].
        fit: the first.
        quiet: the same trials without noise.
    """
    if not hidden:
        return {}
    noise, left = np.radians(noise_deg), np.inf
    if fit.record.pieces is None:
        known = Known.of(noise, world, raw, fit)
        # One more filter, that only who knows the truth has.
        given = [replace(r, filter=cast(Filter, known), noise=noise) for r in (fit.record, quiet)]
        fit = attempt_fit(lambda: fit_from(fit.model, given[0], fit.free, fit.values[None])) or fit
        # To first order alone an effect may show that other constants take when it is whole, as they do of curves.
        exact = attempt_fit(lambda: fit_from(fit.model, given[1], fit.free, fit.values[None]))
        left = np.inf if exact is None else np.sqrt(exact.objective) / noise
    signals = {}
    for name, score in score_effects(fit, (catalogue[name] for name in hidden)).items():
        truth = np.array([hidden[name][p.name.split(".", 1)[1]] / p.scale for p in score.free])
        seen = min(np.sqrt(truth @ score.information @ truth) / fit.record.noise, left)
        threshold = np.sqrt(EVIDENCE + len(truth) * np.log(fit.record.samples)) + POWER
        signals[name] = 0.0 if score.absorbed else float(seen / threshold)
    return signals


@dataclass(frozen=True)
class Known:
    """A filter of residuals (see `identification.whitening`) made of the true covariance of their noise.

    Args:
        root: inverse of its Cholesky factor, times the standard deviation of the white noise, (T, N, N).
    """

    root: Array

    @classmethod
    def of(cls, noise: float, world: World, raw: tuple[int, float], fit: Fit) -> "Known":
        """Of what a recorder, and noise of the EMG, make of the angle; trials have one length."""
        recorder, kept, (samples, dt) = world.recording, fit.record, raw
        passed = np.eye(samples)
        if edge := recorder.get("angle_hz"):
            passed = low_pass(passed, edge, dt)
        if "rate_hz" in recorder:
            clock: Array = np.arange(samples, dtype=np.float64) * dt
            other: Array = np.arange(kept.angle.shape[1], dtype=np.float64) * kept.dt
            passed = resampled(passed, clock, other)
        lag = np.abs(np.subtract.outer(np.arange(samples), np.arange(samples))) * dt
        white = noise**2 * np.eye(samples)
        if "ar_deg" in recorder:
            white += np.radians(recorder["ar_deg"]) ** 2 * np.exp(-lag / recorder["ar_s"])
        rest = (FLOOR * noise) ** 2 + np.radians(recorder.get("step_deg", 0.0)) ** 2 / 12
        covariance = passed.T @ white @ passed + rest * np.eye(passed.shape[1])
        if size := recorder.get("emg_noise"):
            covariance = covariance + _from_emg(fit, size)
        return cls(
            noise
            * np.linalg.inv(np.linalg.cholesky(np.broadcast_to(covariance, (len(kept.names), *covariance.shape[-2:]))))
        )

    def innovations(self, columns: Array) -> Array:
        """Columns (..., T, N, C), white."""
        return np.asarray(self.root @ columns)

    def counted(self, samples: int) -> int:
        """All samples."""
        return samples

    def take(self, index: Sequence[int] | NDArray[np.intp], longest: int) -> "Known":
        """That of some trials."""
        return Known(self.root[list(index)][:, :longest, :longest])


def _from_emg(fit: Fit, size: float) -> Array:
    """Covariance of what noise of the EMG makes of the simulated angle, (T, N, N)."""
    answers, random = [], np.random.default_rng(0)
    for emg, (angle, velocity) in zip(fit.record.emg, fit.starts, strict=True):
        noise = torch.from_numpy(size * random.standard_normal((EMG_DRAWS, *emg.shape)))
        params = {p.name: float(v) for p, v in zip(fit.free, fit.values, strict=True)}
        motion = simulate(Simulation(fit.model, params, (emg + noise).clamp(0.0, 1.0), fit.record.dt), angle, velocity)
        answers.append(np.cov(motion.angle.numpy().T))
    return np.stack(answers)
