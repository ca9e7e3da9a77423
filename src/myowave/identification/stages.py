"""Fit a model in stages where whole trials are too much for it: torque, short horizons, then longer ones.

A model that is far from the truth runs away from the measured motion within a second or two, and where a motion
diverges no step of a fit means anything. So the fit starts in the torque along the measured motion, where nothing can
diverge, and goes on to short predictions from measured states. A model that follows these goes on to longer ones.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
import torch

from myowave.data.trials import Array
from myowave.identification.free_parameters import Free
from myowave.identification.least_squares import FitError
from myowave.identification.output_error import Fit, fit_from, fit_model, fit_simulated
from myowave.identification.prediction import predict
from myowave.identification.record import Record
from myowave.identification.torque import TorqueFit, fit_torque
from myowave.physics.model import Model

Found = TypeVar("Found", Fit, TorqueFit)

HORIZONS_S = (0.5, 1.0, 2.0)
# Share of the motion to be explained over longer pieces, and over whole trials, where noise is a small part of it; what
# misses more is far from linear.
ENOUGH, CLOSE = 0.5, 0.9
# No motion is found, or a matrix is singular or not finite.
FAILURES = (FitError, np.linalg.LinAlgError, torch.linalg.LinAlgError)  # type: ignore[attr-defined]
ENOUGH_PIECES = 80  # to see what a model lacks: 40 s of motion, where a hundred values are unknown at most


def fit_in_stages(model: Model, record: Record, free: Sequence[Free], starts: int = 1) -> Fit:
    """Fit a model to whole trials, or to the shortest pieces of them where they are too much for it.

    Args:
        record: whole trials; all of them are fitted.
        starts: searches side by side, as in `fit_model`.

    Returns:
        A fit whose `record` says the horizon: `record.horizon_s` is None for whole trials.

    Raises:
        FitError: if the model has no motion even over the shortest horizon from its usual values.
    """
    torque = attempt_fit(lambda: fit_torque(model, record, free))
    # Torque diverges nowhere, so its values often lead to a lower valley than any that are spread about the usual ones.
    of_torque = [] if torque is None else [torque.values]
    found = attempt_fit(lambda: fit_model(model, record, free, starts=starts, further=of_torque))
    if found is not None and share_explained(found.record, found.residual) > 0:
        return found
    begins = [*of_torque, np.array([p.start for p in free])]
    shortest = next(filter(None, (_over_all_short_pieces(model, record, free, values) for values in begins)), None)
    return shortest or fit_model(model, record.cut(HORIZONS_S[0]), free, starts=starts)


def lengthen(fit: Fit, record: Record, free: Sequence[Free]) -> Fit:
    """The fit of the same model to pieces as long as it follows, and to whole trials where it follows so far.

    Args:
        fit: to the shortest pieces.
        record: whole trials.
    """
    for horizon_s in (*HORIZONS_S[1:], None):
        if predicted(fit) < ENOUGH:
            break  # ASSUME: what does not follow so long from measured states follows no longer
        longer = fit_nearby(fit.model, record if horizon_s is None else record.cut(horizon_s), free, fit.values)
        if longer is None or share_explained(longer.record, longer.residual) < (ENOUGH if horizon_s else CLOSE):
            break
        fit = longer
    return fit


def over_short_pieces(model: Model, record: Record, free: Sequence[Free], values: Array) -> Fit | None:
    """The fit to the shortest pieces, `ENOUGH_PIECES` spread over whole trials, from the motion that values (P,)
    simulate; None where there is none.

    Where muscles pull against each other, a few per cent of their torque are all that moves the arm. Torque along a
    noisy motion does not tell those, nor constants that nobody measured; over half a second motion does.
    """
    pieces = record.cut(HORIZONS_S[0])
    some = pieces.take(range(0, len(pieces.names), -(-len(pieces.names) // ENOUGH_PIECES)))
    return attempt_fit(lambda: fit_simulated(model, some, free, values))


def _over_all_short_pieces(model: Model, record: Record, free: Sequence[Free], values: Array) -> Fit | None:
    """The same to all of them, from the fit to some."""
    some = over_short_pieces(model, record, free, values)
    if some is None:
        return None
    return attempt_fit(lambda: fit_simulated(model, record.cut(HORIZONS_S[0]), free, some.values))


def predicted(fit: Fit) -> float:
    """Share of the motion that is predicted from measured states [-], see `share_explained`. A fit may move
    the starts of pieces within the error of their measurement."""
    return share_explained(fit.record, predict(fit, fit.record).residual)


def share_explained(record: Record, residual: Array) -> float:
    """Share [-] of the motion about a constant angle for each trial, or piece of one, that is not in a residual
    (T, N)."""
    angle, valid = record.angle, record.valid
    mean = (angle * valid).sum(-1, keepdims=True) / valid.sum(-1, keepdims=True)
    return 1.0 - float((residual**2).sum()) / max(float((((angle - mean) * valid) ** 2).sum()), 1e-300)


def fit_nearby(model: Model, record: Record, free: Sequence[Free], values: Array) -> Fit | None:
    """The fit from given values (P,): from the measured motion, else from the one that the values simulate; None where
    neither leads to one."""
    fit = attempt_fit(lambda: fit_from(model, record, free, values[None]))
    return fit or attempt_fit(lambda: fit_simulated(model, record, free, values))


def attempt_fit(fit: Callable[[], Found | None]) -> Found | None:
    """A fit, or None where it fails: its motion diverges, or its sums are not finite."""
    try:
        found = fit()
    except FAILURES:
        return None
    return found if found is not None and np.isfinite(found.values).all() else None
