"""Could something that the catalogue does not hold do the work of an effect that is named?

Parts of a general correction (a torque that goes with the angle, the velocity, an activation; an excitation that is
late, or of another muscle; a sensor that is off) are weighed against the effect, first all to first order from the fit
without it. What promises about as much as the effect did is then fitted as the effect was: where much is missing a
promise is a small part of what a fit gains. A part that the catalogue holds, under whatever name, has been weighed as
an effect and does not count. And an effect must be evident with the shapes of the muscles' curves integrated out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from myowave.diagnosis.causes import OWN_CURVES
from myowave.diagnosis.evidence import EVIDENCE, MARGIN, delta_bic, independent_samples
from myowave.diagnosis.misfit.own_curves import integrate_out_curves
from myowave.diagnosis.misfit.repeated import correcting_effects, corrections
from myowave.diagnosis.search.rank import Candidate, race
from myowave.diagnosis.search.score import ABSORBED, score_effects
from myowave.identification.output_error import Fit
from myowave.physics.effect import Effect

Array = NDArray[np.float64]
Span = tuple[bool, Array]

SENSOR = "observation"  # the stage of effects on the measured angle
SAME = 0.99  # cosine between what two changes do to the motion, above which they are one
MOST = 2  # that are told, and fitted
HOPEFUL = 0.5  # of what the effect promised: what promises less is not fitted


@dataclass(frozen=True)
class StandIns:
    """What the catalogue does not hold and that would do for an effect.

    Args:
        names: in words, the best first; at most `MOST`, the shape of the curves, and `MOST` in place of all effects.
        better: whether the best of them fits better than the effect, beyond doubt.
    """

    names: tuple[str, ...] = ()
    better: bool = False

    @property
    def curves(self) -> bool:
        """Whether muscle curves of another shape are among them."""
        return OWN_CURVES in self.names

    def or_instead_of_all(self, others: "StandIns") -> "StandIns":
        """The same with what would do for this effect and all that are named beside it."""
        names = tuple(f"{name} instead of all effects named" for name in others.names)
        return StandIns(self.names + names, self.better or others.better)


def find_stand_ins(without: Fit, effect: Candidate, ranking: Sequence[Candidate]) -> StandIns:
    """Weigh the parts of a general correction, and other curves, against an effect.

    Args:
        without: the fit without the effect.
        effect: as weighed there.
        ranking: of all effects there.
    """
    found = _weigh_parts(without, effect.refitted, effect.score.drop, ranking)
    if evidence_for_any_curves(without, effect) < EVIDENCE:
        return replace(found, names=(*found.names, OWN_CURVES))
    return found


def find_stand_ins_for_all(without: Fit, with_them: Fit, ranking: Sequence[Candidate]) -> StandIns:
    """Weigh the parts of a general correction, each alone, against several effects together.

    Args:
        without, with_them: the fits without any of them and with all.
        ranking: of all effects at the first.
    """
    added = {e.name for e in with_them.model.effects} - {e.name for e in without.model.effects}
    promised = max((c.score.drop for c in ranking if c.name in added), default=0.0)
    return _weigh_parts(without, with_them, promised, ranking)


def _weigh_parts(without: Fit, with_it: Fit, promised: float, ranking: Sequence[Candidate]) -> StandIns:
    """The parts that do as well as what is named.

    Args:
        without, with_it: the fits without it and with it.
        promised: how much the objective would fall with it, to first order.
        ranking: of all effects at the fit without it.
    """
    parts, effects = corrections(without), correcting_effects(without)
    names = list(parts)
    columns = np.stack([*parts.values()], -1)
    (signals, _), left = without.normal.beyond(columns), without.normal.left
    size, whole = np.sqrt((signals**2).sum(0)), np.sqrt((columns**2).sum((0, 1)))
    seen = size > ABSORBED * np.maximum(whole, 1e-300)
    unit = signals / np.where(seen, size, 1.0)
    spans = _spans(ranking)
    counts = seen & ~_in_catalogue(unit, [name in effects and effects[name].acts_on == SENSOR for name in names], spans)
    drops = np.where(counts, (unit.T @ left) ** 2, 0.0)
    best = {names[i]: float(drops[i]) for i in np.argsort(-drops)[:MOST] if drops[i] > 0}
    best = _fitted(without, with_it, best, effects, promised, spans)
    samples = independent_samples(with_it)
    most = max(promised, without.objective - with_it.objective)
    own = delta_bic(without, without.objective - most, 0, samples)
    ahead = {
        name: delta_bic(without, max(without.objective - fall, 0.0), 0, samples) - own for name, fall in best.items()
    }
    spared = (len(with_it.free) - len(without.free) - 1) * np.log(samples)
    # One number less is no proof: a cause may have one for each muscle.
    as_good = tuple(name for name in sorted(ahead, key=lambda name: -ahead[name]) if ahead[name] + spared > -MARGIN)
    return StandIns(as_good, any(lead > MARGIN for lead in ahead.values()))


def _fitted(
    without: Fit,
    with_it: Fit,
    drops: Mapping[str, float],
    effects: Mapping[str, Effect],
    promised: float,
    spans: Sequence[Span],
) -> dict[str, float]:
    """How much the objective falls with each part, those fitted that are effects and promise enough; without those that
    the catalogue does hold, as a look at them as effects shows.

    Args:
        drops: what the parts promise.
        effects: all parts that are effects.
        promised: see `_weigh_parts`.
        spans: of the catalogue.
    """
    effects = {name: effects[name] for name in drops if name in effects}
    scored = score_effects(without, effects.values())
    scores = {name: scored[effect.name] for name, effect in effects.items() if not scored[effect.name].failure}
    known = {}
    for name, score in scores.items():
        unit = score.signal / np.sqrt((score.signal**2).sum(0)).clip(1e-300)
        known[name] = bool(_in_catalogue(unit, [effects[name].acts_on == SENSOR], spans).all())
    starts = {n: score.start for n, score in scores.items() if not known[n] and drops[n] > HOPEFUL * promised}
    fits, _ = race(starts, [with_it])
    falls = {name: without.objective - fit.objective for name, fit in fits.items()}
    return {name: max(drop, falls.get(name, drop)) for name, drop in drops.items() if not known.get(name, False)}


def _spans(ranking: Sequence[Candidate]) -> list[Span]:
    """What each effect that the data show can do to the motion: whether it is one of the sensor, and directions."""
    spans = []
    for candidate in ranking:
        if not (candidate.failure or candidate.score.absorbed):
            directions, strengths, _ = np.linalg.svd(candidate.score.signal, full_matrices=False)
            shown = directions[:, strengths > 1e-6 * strengths.max(initial=0.0)]
            spans.append((candidate.effect.acts_on == SENSOR, shown))
    return spans


def _in_catalogue(unit: Array, of_sensor: Sequence[bool], spans: Sequence[Span]) -> NDArray[np.bool_]:
    """Which parts an effect of the catalogue does, of the sensor for those of a sensor: a muscle that lags is no sensor
    that does, though nothing tells the two apart.

    Args:
        unit: what each part does to the motion, of unit length, one per column.
        of_sensor: whether it is one of the sensor.
        spans: of the catalogue.
    """
    known = np.zeros(unit.shape[1], bool)
    for by_sensor, directions in spans:
        alike = np.array(of_sensor) == by_sensor
        known |= alike & (np.sqrt(((directions.T @ unit) ** 2).sum(0)) > SAME)
    return known


def evidence_for_any_curves(without: Fit, effect: Candidate) -> float:
    """Difference of BIC in favour of an effect, the shapes of the muscles' curves integrated out with and without it.

    Args:
        without: the fit without the effect.
        effect: as weighed there.
    """
    with_it, samples = effect.refitted, independent_samples(effect.refitted)
    before, after = (integrate_out_curves(fit, with_it.independent_variance) for fit in (without, with_it))
    gained = delta_bic(without, with_it.objective - after.drop, len(effect.score.free), samples)
    return gained - delta_bic(without, without.objective - before.drop, 0, samples) + before.occam - after.occam
