"""What the evidence allows to say, and not more."""

from dataclasses import dataclass
from functools import cached_property

from myowave.diagnosis.causes import LEFT, OUTSIDE, OWN_SHAPES
from myowave.diagnosis.search.answer import ANYTHING, Answer, Kind
from myowave.diagnosis.search.ladder import Ladder

CERTAINLY_OUTSIDE = 2.0  # standard errors


@dataclass(frozen=True)
class Verdict:
    """An answer and the models that lead there, as pages and scoring are told them."""

    answer: Answer
    ladder: Ladder

    @property
    def follows(self) -> bool:
        """Whether the base model, or one with effects, follows whole trials; where none does, none is named."""
        return self.ladder.fit.record.pieces is None

    @cached_property
    def kind(self) -> Kind:
        """See `answer.Kind`; a parameter where nobody expects it may hide an effect, and curves and paths are none."""
        if self.answer.of_shapes:
            return "partial" if self.named else "unknown"
        return "undecidable" if self.answer.kind == "adequate" and self._unusual else self.answer.kind

    @property
    def named(self) -> tuple[tuple[str, ...], ...]:
        """Classes of what is missing, most of one: those of effects that were added, in that order, then others, each
        with what the last model has before what would do as well, and what the catalogue lacks behind all that it has.
        Own shapes alone are no part of it."""
        order = {name: place for place, name in enumerate(self.ladder.effects)}
        sorted_each = [sorted(c, key=lambda n: (n == OUTSIDE, order.get(n, len(order)))) for c in self.answer.named]
        classes = [tuple(c) for c in sorted_each if c != [OWN_SHAPES]]
        return tuple(sorted(classes, key=lambda c: order.get(c[0], len(order))))

    @property
    def causes(self) -> tuple[str, ...]:
        """The first of each class."""
        return tuple(members[0] for members in self.named)

    @property
    def nearest(self) -> tuple[str, ...]:
        """Effects that come nearest where none is named."""
        return self.answer.best.effects if self.kind == "unknown" else ()

    @property
    def absorbed(self) -> dict[str, tuple[str, ...]]:
        """Effects that no such data can show, with the parameters that take their place."""
        return {c.name: c.score.absorbed_by for c in self.ladder.rankings[-1] if c.score.absorbed}

    @property
    def masked(self) -> dict[str, tuple[str, ...]]:
        """Where nothing else seems to be left, parameters outside their usual range, with what would explain that."""
        return {} if self.left else self._unusual

    @property
    def maybe(self) -> tuple[str, ...]:
        """Effects of the catalogue among these."""
        return tuple(sorted({name for names in self.masked.values() for name in names} - {ANYTHING}))

    @property
    def left(self) -> bool:
        """Whether more is left than noise."""
        return self.kind in LEFT

    @property
    def explained(self) -> float:
        """Share of the mean square that the base model leaves above the noise which the effects found take away [-]."""
        noise = self.answer.angle_noise**2
        before, after = (max(fit.rmse() ** 2 - noise, 0.0) for fit in (self.ladder.fits[0], self.ladder.fit))
        return max(1.0 - after / before, 0.0) if before else 0.0

    @cached_property
    def _unusual(self) -> dict[str, tuple[str, ...]]:
        """Parameters outside the range where their searches start, with the effects that may have moved them there.

        An absorbed effect changes no motion, only the parameters. Nothing but what is known of these can betray it.
        """
        absorbed, estimate, found = self.absorbed, self.ladder.estimates[-1], {}
        for p in self.ladder.fit.free:
            value, error = estimate[p.name]
            beyond = abs(value - p.start) - p.spread * abs(p.start)
            names = tuple(effect for effect, by in absorbed.items() if p.name in by)
            if p.spread > 0 and names and beyond > CERTAINLY_OUTSIDE * error:
                found[p.name] = names
        return found | self.answer.unusual
