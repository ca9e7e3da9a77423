"""What the evidence allows to say, and not more."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from myowave.diagnosis.misfit.independence import Independence
from myowave.diagnosis.search.rank import EVIDENCE
from myowave.diagnosis.search.selection import Selection
from myowave.identification.output_error import Fit

Kind = Literal["adequate", "effect", "class", "unknown", "undecidable"]

ENOUGH = 0.8  # share of the excess over the noise that named effects must explain where structure is left after them


@dataclass(frozen=True)
class Verdict:
    """The answer.

    Args:
        kind: adequate; effect (named ones); class (some cannot be told apart); unknown (something is missing that no
            effect explains); undecidable (a parameter may hide an effect).
        effects: accepted, in the order they were added.
        alternatives: for each effect that others stand in for equally well, all of them.
        absorbed: effects that no such data can show: {effect: the parameters that take their place}.
        explained: share of the excess over the noise that the effects explain [-].
        structure_left: whether the residual still depends on the inputs.
        masked: with undecidable, {parameter outside its usual range: effects that would explain it}.
        follows: whether the base model follows the trials at all; where it does not, no effect was weighed.
    """

    kind: Kind
    effects: tuple[str, ...]
    alternatives: tuple[tuple[str, ...], ...]
    absorbed: Mapping[str, tuple[str, ...]]
    explained: float
    structure_left: bool
    masked: Mapping[str, tuple[str, ...]]
    follows: bool = True


def judge(selection: Selection, independence: Independence, *, follows: bool = True) -> Verdict:
    """Weigh what the search found.

    Args:
        independence: of the residual of the last fit.
        follows: see `Verdict`.
    """
    fit, last = selection.fit, selection.rankings[-1]
    absorbed = {c.name: c.score.absorbed_by for c in last if c.score.absorbed}
    alternatives = tuple(c for c in selection.classes.values() if len(c) > 1)
    explained = _explained(selection.ladder[0], fit)
    structure_left = not independence.holds
    masked = _masked(fit, absorbed)
    kind: Kind
    if not follows or (selection.classes and structure_left and explained < ENOUGH):
        kind = "unknown"
    elif selection.classes:
        kind = "class" if alternatives else "effect"
    elif structure_left or any(c.delta_bic > EVIDENCE for c in last if c.fit is not None):
        kind = "unknown"
    else:
        kind = "undecidable" if masked else "adequate"
    return Verdict(kind, selection.effects, alternatives, absorbed, explained, structure_left, masked, follows)


def _explained(first: Fit, last: Fit) -> float:
    noise = first.record.samples * first.record.noise**2
    excess, left = first.rss - noise, last.rss - noise
    return float(np.clip(1 - left / excess, 0.0, 1.0)) if excess > 0 else 0.0


def _masked(fit: Fit, absorbed: Mapping[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    """Parameters outside the range where their searches start, with the effects that may have moved them there.

    An absorbed effect changes no motion, only the parameters. Nothing but what is known of these can betray it.
    """
    errors = fit.standard_errors()
    found = {}
    for p, value in zip(fit.free, fit.values, strict=True):
        beyond = abs(value - p.start) - p.spread * abs(p.start)
        names = tuple(effect for effect, by in absorbed.items() if p.name in by)
        if p.spread > 0 and names and beyond > 2 * errors[p.name]:
            found[p.name] = names
    return found
