"""Could something that the catalogue does not hold do the work of an effect that is named?

Parts of a general correction (a torque that goes with the angle, the velocity, an activation; an excitation that is
late, or of another muscle) are weighed against the effect, first all to first order from the fit without it. What
promises about as much as the effect did is then fitted as the effect was: where much is missing a promise is a small
part of what a fit gains. A part that the catalogue holds, under whatever name, has been weighed as an effect and does
not count. And an effect must be evident where the muscles' curves may have a shape of their own.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from myowave.diagnosis.causes import OWN_CURVES
from myowave.diagnosis.misfit.own_curves import freed
from myowave.diagnosis.misfit.repeated import correcting_effects, corrections
from myowave.diagnosis.search.rank import EVIDENCE, MARGIN, Candidate, delta_bic, independent_samples, race
from myowave.diagnosis.search.score import ABSORBED, score_effects
from myowave.identification.output_error import Fit

SAME = 0.99  # cosine between what two changes do to the motion, above which they are one
MOST = 2  # that are told, and fitted
HOPEFUL = 0.5  # of what the effect promised: what promises less is not fitted


@dataclass(frozen=True)
class StandIns:
    """What the catalogue does not hold and that would do for an effect.

    Args:
        names: in words, the best first; at most `MOST` and the shape of the curves.
        better: whether the best of them does better than the effect, beyond doubt.
    """

    names: tuple[str, ...] = ()
    better: bool = False

    @property
    def curves(self) -> bool:
        """Whether muscle curves of another shape are among them."""
        return OWN_CURVES in self.names


def find_stand_ins(without: Fit, effect: Candidate, ranking: Sequence[Candidate]) -> StandIns:
    """Weigh the parts of a general correction against an effect.

    Args:
        without: the fit without the effect.
        effect: as weighed there.
        ranking: of all effects there.
    """
    parts = corrections(without)
    names = list(parts)
    columns = np.stack([*parts.values()], -1)
    (signals, _), left = without.normal.beyond(columns), without.normal.left
    size, whole = np.sqrt((signals**2).sum(0)), np.sqrt((columns**2).sum((0, 1)))
    seen = size > ABSORBED * np.maximum(whole, 1e-300)
    unit = signals / np.where(seen, size, 1.0)
    held = np.zeros(len(parts), bool)
    for candidate in ranking:
        if not (candidate.failure or candidate.score.absorbed):
            directions, strengths, _ = np.linalg.svd(candidate.score.signal, full_matrices=False)
            directions = directions[:, strengths > 1e-6 * strengths.max(initial=0.0)]
            held |= np.sqrt(((directions.T @ unit) ** 2).sum(0)) > SAME
    drops = np.where(seen & ~held, (unit.T @ left) ** 2, 0.0)
    samples = independent_samples(effect.refitted)
    most = max(effect.score.drop, without.objective - effect.refitted.objective)
    own = delta_bic(without, without.objective - most, len(effect.score.free), samples)
    best = {names[i]: float(drops[i]) for i in np.argsort(-drops)[:MOST] if drops[i] > 0}
    for name, fall in _fitted_falls(without, effect, best).items():
        best[name] = max(best[name], fall)
    ahead = {
        name: delta_bic(without, max(without.objective - fall, 0.0), 1, samples) - own for name, fall in best.items()
    }
    as_good = tuple(name for name in sorted(ahead, key=lambda name: -ahead[name]) if ahead[name] > -MARGIN)
    if evidence_beside_curves(without, effect) < EVIDENCE:
        as_good += (OWN_CURVES,)
    return StandIns(as_good, any(lead > MARGIN for lead in ahead.values()))


def evidence_beside_curves(without: Fit, effect: Candidate) -> float:
    """Difference of BIC in favour of an effect where the muscles' curves have a shape of their own with and without it.

    Args:
        without: the fit without the effect.
        effect: as weighed there.
    """
    with_it, samples = effect.refitted, independent_samples(effect.refitted)
    before, after = (freed(fit, with_it.independent_variance) for fit in (without, with_it))
    gained = delta_bic(without, with_it.objective - after.drop, len(effect.score.free), samples)
    return gained - delta_bic(without, without.objective - before.drop, 0, samples) + before.occam - after.occam


def _fitted_falls(without: Fit, effect: Candidate, promised: Mapping[str, float]) -> dict[str, float]:
    """How much the objective falls with parts of the correction that promise enough, each fitted beside the effect."""
    parts = correcting_effects(without.model)
    hopeful = {
        name: parts[name] for name, drop in promised.items() if name in parts and drop > HOPEFUL * effect.score.drop
    }
    scores = score_effects(without, hopeful.values())
    starts = {name: scores[part.name].start for name, part in hopeful.items() if not scores[part.name].failure}
    fits, _ = race(starts, [effect.refitted])
    return {name: without.objective - fit.objective for name, fit in fits.items()}
