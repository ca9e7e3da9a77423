"""Lead a model to whole trials that it does not follow by itself, through what it lacks.

A model that lacks much runs away within a second, and what it lacks is why. Over half a second it cannot get far, so
effects are sought there. With these it is taken to longer pieces and to whole trials; then they are taken away again
one by one, each fit from the motion of the one before, so that the model without any is fitted to whole trials as well.
What is named is what was found over half a second: over whole trials the model without it is far from linear.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from myowave.diagnosis.search.conclude import Findings, conclude
from myowave.diagnosis.search.score import FAILURES
from myowave.diagnosis.search.selection import select_effects
from myowave.identification.free_parameters import Free
from myowave.identification.output_error import Fit, refit
from myowave.identification.record import Record
from myowave.identification.stages import lengthen, over_short_pieces
from myowave.physics.effect import Effect


def follow(fit: Fit, whole: Record, effects: Iterable[Effect], free: Sequence[Free]) -> Findings | None:
    """What a model lacks, by short pieces, with its fits to whole trials; None where it does not follow these with any
    effect.

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
        ladder = [lengthen(found.fit, whole, found.fit.free)]
        if ladder[0].record.pieces is not None:
            return None
        for rung in found.ladder[-2::-1]:
            ladder.insert(0, refit(ladder[0], rung.model, rung.free))
    except FAILURES:  # no motion is found near the one before
        return None
    return conclude(replace(found, ladder=tuple(ladder), visited={}, weighed={}))
