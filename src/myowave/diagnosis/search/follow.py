"""Lead a model to whole trials that it does not follow by itself, through what it lacks.

A model that lacks much runs away within a second, and what it lacks is why. Over half a second it cannot get far, so
effects are sought there. With these it is taken to longer pieces and to whole trials; then they are taken away again
one by one, each fit from the motion of the one before. So the model without any is fitted to whole trials as well, and
effects are weighed there as in any other arm.
"""

from collections.abc import Iterable, Sequence

from myowave.diagnosis.search.score import FAILURES
from myowave.diagnosis.search.selection import select_effects
from myowave.identification.free_parameters import Free
from myowave.identification.output_error import Fit, refit
from myowave.identification.record import Record
from myowave.identification.stages import lengthen, over_short_pieces
from myowave.physics.effect import Effect


def follow(fit: Fit, whole: Record, effects: Iterable[Effect], free: Sequence[Free]) -> Fit | None:
    """The fit of the same model to whole trials, reached with effects that are then taken away; None where it does not
    follow them with any.

    Args:
        fit: of the model, which does not follow.
        whole: the trials that were fitted, whole.
        effects: the catalogue.
        free: what is estimated of the model.
    """
    short = over_short_pieces(fit.model, whole, free, fit.values)
    if short is None:
        return None
    try:
        found = select_effects(short, effects, whole.known)
        if not found.effects:
            return None
        led = lengthen(found.fit, whole, found.fit.free)
        if led.record.pieces is not None:
            return None
        for rung in found.ladder[-2::-1]:
            led = refit(led, rung.model, rung.free)
    except FAILURES:  # no motion is found near the one before
        return None
    return led
