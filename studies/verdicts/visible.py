"""Whether trials show an effect, to one who knows what was hidden and the covariance of the noise.

Shapes: T trials, N samples, R samples before a recorder took them at another rate.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
import torch

from myowave.data.trials import Array
from myowave.diagnosis.search.score import POWER, score_effects
from myowave.identification.least_squares import Normal, pseudo_inverse
from myowave.identification.output_error import Fit, fit_from
from myowave.identification.record import Record
from myowave.identification.stages import attempt_fit
from myowave.physics.effect import Effect
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation
from studies.shared import low_pass
from studies.verdicts.worlds import World, resampled

EVIDENCE = 10.0  # chi-square that counts as very strong evidence (Kass & Raftery 1995)
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
    noise, left, root = np.radians(noise_deg), np.inf, None
    if fit.record.pieces is None:
        root = whitening(noise, world, raw, fit)
        given = [replace(record, noise=noise) for record in (fit.record, quiet)]
        fits = [attempt_fit(partial(fit_from, fit.model, r, fit.free, fit.values[None])) for r in given]
        fit = fits[0] or fit
        # To first order alone an effect may show that other constants take when it is whole, as they do of curves.
        if fits[1] is not None:
            exact = whitened(fits[1].normal, root)
            left = np.sqrt(exact.objective - exact.vector @ pseudo_inverse(exact.matrix) @ exact.vector) / noise
    signals = {}
    for name, score in score_effects(fit, (catalogue[name] for name in hidden)).items():
        truth = np.array([hidden[name][p.name.split(".", 1)[1]] / p.scale for p in score.free])
        information = score.information
        if root is not None:
            signal, _ = whitened(fit.normal, root).beyond(root @ score.start.normal.slope[..., len(fit.free) :])
            information = signal.T @ signal
        seen = min(np.sqrt(truth @ information @ truth) / fit.record.noise, left)
        threshold = np.sqrt(EVIDENCE + len(truth) * np.log(fit.record.samples)) + POWER
        signals[name] = 0.0 if score.absorbed else float(seen / threshold)
    return signals


def whitened(normal: Normal, root: Array) -> Normal:
    """The same normal equations of residuals and derivatives (T, N, ...) multiplied by a root (T, N, N)."""
    residual = (root @ normal.residual[..., None])[..., 0]
    return replace(normal, residual=residual, slope=root @ normal.slope, by_start=root @ normal.by_start)


def whitening(noise: float, world: World, raw: tuple[int, float], fit: Fit) -> Array:
    """What makes noise of the angle white again that a recorder, and noise of the EMG, has made something of: the
    inverse root of its covariance, times the standard deviation of the white noise; trials have one length, (T, N, N).
    """
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
    covariance = np.broadcast_to(covariance, (len(kept.names), *covariance.shape[-2:]))
    return np.asarray(noise * np.linalg.inv(np.linalg.cholesky(covariance)))


def _from_emg(fit: Fit, size: float) -> Array:
    """Covariance of what noise of the EMG makes of the simulated angle, (T, N, N)."""
    answers, random = [], np.random.default_rng(0)
    for emg, (angle, velocity) in zip(fit.record.emg, fit.starts, strict=True):
        noise = torch.from_numpy(size * random.standard_normal((EMG_DRAWS, *emg.shape)))
        noisy = Simulation(fit.model, fit.parameters, (emg + noise).clamp(0.0, 1.0), fit.record.dt)
        answers.append(np.cov(simulate(noisy, angle, velocity).angle.numpy().T))
    return np.stack(answers)
