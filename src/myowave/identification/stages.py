"""Fit a model in stages where whole trials are too much for it: torque, short horizons, then longer ones.

A model that is far from the truth runs away from the measured motion within a second or two, and where a motion
diverges no step of a fit means anything. So the fit starts in the torque along the measured motion, where nothing can
diverge, and goes on to short predictions from starts of their own, and then to longer ones. It stands on the longest
that works.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from myowave.data.trials import Array
from myowave.identification.free_parameters import Free
from myowave.identification.output_error import Fit, fit_from, fit_model, fit_simulated, refit
from myowave.identification.prediction import predict
from myowave.identification.record import Record
from myowave.identification.torque import TorqueFit, fit_torque, leave_out
from myowave.physics.model import Model

Found = TypeVar("Found", Fit, TorqueFit)

HORIZONS_S = (0.5, 1.0, 2.0)
ENOUGH = 0.5  # share of the motion to be explained over longer pieces; what misses more is far from linear
ENOUGH_PIECES = 80  # to see what a model lacks: 40 s of motion, where a hundred values are unknown at most


def fit_in_stages(model: Model, record: Record, free: Sequence[Free], starts: int = 1) -> Fit:
    """Fit a model to whole trials, or to the longest pieces of them that it is able to predict, or to torque.

    Args:
        record: whole trials; all of them are fitted.
        starts: searches side by side, as in `fit_model`.

    Returns:
        A fit whose `record` says the horizon: `record.horizon_s` is None for whole trials. Where the model does not
        even follow the shortest pieces its values are those of `Fit.torque`.

    Raises:
        ValueError: if the model has no motion even over the shortest horizon from its usual values.
    """
    pieces = record.cut(HORIZONS_S[0])
    torque = attempt_torque(model, record, free)
    # Torque diverges nowhere, so its values often lead to a lower valley than any that are spread about the usual ones.
    of_torque = [] if torque is None else [torque.values]
    found = attempt_fit(lambda: fit_model(model, record, free, starts=starts, further=of_torque))
    if found is not None and explained(found) > 0:
        return found
    # ASSUME: motion that a model does not follow over whole trials tells nothing of constants that nobody measured;
    # torque does, and they stay where it leaves them.
    shortest = None if torque is None else _from_torque(model, pieces, torque)
    if shortest is None:
        certain = [p for p in free if not p.assumed]
        usual = np.array([p.start for p in certain])
        shortest = _next(model, pieces, certain, usual) or fit_model(model, pieces, certain, starts=starts)
    if shortest.torque is not None:
        return shortest
    longest = lengthen(shortest, record, shortest.free)
    if longest.record.pieces is not None:
        return longest
    # Over whole trials it does follow now, so what was fixed is estimated like the rest.
    freed = attempt_fit(lambda: refit(longest, model, free))
    return longest if freed is None or explained(freed) < explained(longest) else freed


def lengthen(fit: Fit, record: Record, free: Sequence[Free]) -> Fit:
    """The fit of the same model to pieces as long as it follows, and to whole trials where it follows so far.

    Args:
        fit: to the shortest pieces.
        record: whole trials.
    """
    for horizon_s in (*HORIZONS_S[1:], None):
        longer = _next(fit.model, record if horizon_s is None else record.cut(horizon_s), free, fit.values)
        if longer is None or explained(longer) < ENOUGH:
            break
        fit = longer
        if not follows(fit):
            break  # ASSUME: what does not follow so long from measured states follows no longer
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


def fit_like(standing: Fit, model: Model, free: Sequence[Free]) -> Fit:
    """A model with further effects, fitted as far as one that stands on torque: to torque, then to short pieces.

    Raises:
        ValueError: if it has no fit to torque, or no motion.
    """
    torque = attempt_torque(model, standing.record.whole, free)
    found = None if torque is None else _from_torque(model, standing.record, torque)
    if found is None:
        raise ValueError("not fitted: the measured angle says nothing of its states, or it has no motion there")
    return found


def _from_torque(model: Model, pieces: Record, torque: TorqueFit) -> Fit | None:
    """The fit to short pieces from one to torque; the latter, with its scores, where the model does not follow them."""
    standing = _on_torque(model, pieces, torque)
    if standing is None:
        return None
    some = [fixed if p.assumed else p for p, fixed in zip(torque.free, torque.fixed, strict=True)]
    shortest = _next(model, pieces, some, torque.values)
    return _scored(standing) if shortest is None or not follows(shortest) else shortest


def _on_torque(model: Model, pieces: Record, torque: TorqueFit) -> Fit | None:
    """The motion over pieces with the values of a fit to torque; only where a piece starts is estimated."""
    fit = attempt_fit(lambda: fit_simulated(model, pieces, torque.fixed, torque.values))
    return None if fit is None else replace(fit, torque=torque)


def _scored(standing: Fit) -> Fit:
    """A fit that stands on torque, with the scores of each trial left out."""
    assert standing.torque is not None
    scores = leave_out(standing.model, standing.record.whole, standing.torque.free)
    return replace(standing, torque=replace(standing.torque, left_out=scores))


def follows(fit: Fit) -> bool:
    """Whether a model that was fitted to pieces of trials predicts them from measured states, too, better than a
    constant angle does. Pieces are fitted from starts of their own, which can make up for much over a short horizon."""
    return fit.record.pieces is None or share_explained(fit.record, predict(fit, fit.record).residual) > 0


def explained(fit: Fit) -> float:
    """Share of the motion that a fit explains [-], see `share_explained`."""
    return share_explained(fit.record, fit.residual)


def share_explained(record: Record, residual: Array) -> float:
    """Share [-] of the motion about a constant angle for each trial, or piece of one, that is not in a residual
    (T, N)."""
    angle, valid = record.angle, record.valid
    mean = (angle * valid).sum(-1, keepdims=True) / valid.sum(-1, keepdims=True)
    return 1.0 - float((residual**2).sum()) / max(float((((angle - mean) * valid) ** 2).sum()), 1e-300)


def _next(model: Model, record: Record, free: Sequence[Free], values: Array) -> Fit | None:
    """The fit from given values (P,): from the measured motion, else from the one that the values simulate."""
    fit = attempt_fit(lambda: fit_from(model, record, free, values[None]))
    return fit or attempt_fit(lambda: fit_simulated(model, record, free, values))


def attempt_torque(model: Model, record: Record, free: Sequence[Free]) -> TorqueFit | None:
    """The fit to torque, or None where there is none."""
    return attempt_fit(lambda: fit_torque(model, record, free))


def attempt_fit(fit: Callable[[], Found | None]) -> Found | None:
    """A fit, or None where it fails: its motion diverges, or its sums are not finite."""
    try:
        found = fit()
    except (ValueError, np.linalg.LinAlgError):
        return None
    return found if found is not None and np.isfinite(found.values).all() else None
