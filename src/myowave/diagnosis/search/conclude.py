"""Search for what a fitted model lacks, beside a random force where it leaves more than noise; see what is left.

Where a model leaves more than the noise of the angle, an effect of the catalogue is missing, or one that is not in it,
or the EMG itself is noisy. The last two push the arm by forces that no model has. So effects are weighed beside such a
force, of the size that the residual calls for: one that is named then has evidence that the force cannot take from it.
Where no force is needed beside the effects found, they are weighed again without.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import torch

from myowave.diagnosis.misfit.filtered import WHITE, has_passed_a_filter, lacks_noise
from myowave.diagnosis.misfit.own_curves import freed
from myowave.diagnosis.misfit.repeated import Repeated, repeated_misfit
from myowave.diagnosis.misfit.size import Size, size_of, size_of_misfit
from myowave.diagnosis.search.rank import EVIDENCE, Candidate, delta_bic, rank_effects
from myowave.diagnosis.search.score import FAILURES
from myowave.diagnosis.search.selection import Selection, select_effects, without_effect, without_some
from myowave.diagnosis.search.stand_ins import StandIns, find_stand_ins, find_stand_ins_for_all
from myowave.identification.disturbance import Disturbance, estimate_disturbance
from myowave.identification.expected_emg import expected_excitation
from myowave.identification.noise import SMALLEST_NOISE_DEG, correlation_time
from myowave.identification.output_error import Fit, fit_from, refit
from myowave.identification.spectrum import ABOVE
from myowave.identification.stages import attempt_fit
from myowave.identification.whitening import MotionBand
from myowave.physics.effect import Effect

MOST_OF_IT = 0.9  # share that effects must explain to be named where something else is left
ROUGHLY = 3.0  # times what noise gives: a random force is not exactly as assumed, and leaves a little
REST = 0.1  # share of the evidence for a random force that effects may leave where they are weighed without it
NOTHING = 0.3  # of the noise, or of what a filter leaves of it: less raises the error by less than 5 %, and is nothing


@dataclass(frozen=True)
class Findings:
    """What a search found, and what it leaves.

    Args:
        size: of the last fit's misfit.
        slow: see `Size.certain`; beside the random force, if there is one, and 0 for what such a force may leave.
        repeated: see `misfit.repeated`; of the last fit.
        disturbance: the random force beside which effects were weighed; None where none was needed.
        settled: whether what the last fit leaves, beside that force, is noise.
        of_curves: where it is not, whether it would be with muscle curves of another shape.
        stand_ins: for each effect found, what the catalogue does not hold and that would do as well.
        beside: each effect found, weighed at the fit with all the others.
    """

    selection: Selection
    size: Size
    slow: float
    repeated: Repeated
    disturbance: Disturbance | None = None
    settled: bool = True
    of_curves: bool = False
    stand_ins: Mapping[str, StandIns] = field(default_factory=dict)
    beside: Mapping[str, Candidate] = field(default_factory=dict)

    @property
    def variance(self) -> float:
        """Of what is independent in the last fit's residual [rad^2]."""
        return self.selection.fit.independent_variance

    @property
    def explained(self) -> float:
        """What the effects found explain, as a share of it and of what is certainly left [-]."""
        first, last = self.selection.ladder[0], self.selection.fit
        explained = (first.objective - last.objective) / self.variance
        left = max(self.repeated.certain, self.slow)
        return float(explained / max(explained + left, 1e-300)) if explained > 0 else 0.0

    @property
    def carries(self) -> bool:
        """Whether the effects found may be named: nothing that the catalogue does not hold does better, and nothing
        else is left and no force was needed beside them, or little is left beside what they explain. What goes with
        the shape of the curves may be left beside an effect that stands where curves are free."""
        if any(other.better for other in self.stand_ins.values()):
            return False
        stands = not self.stand_ins or any(not other.curves for other in self.stand_ins.values())
        all_told = (self.settled or (self.of_curves and stands)) and self.disturbance is None
        return all_told or self.explained >= MOST_OF_IT


def search(fit: Fit, effects: Iterable[Effect], known: Collection[str] = ()) -> Findings:
    """Find the effects that a fitted model lacks.

    Args:
        effects: the catalogue.
        known: names of parameters that are known and so not to be estimated.
    """
    effects = tuple(effects)
    found = _search(fit, effects, known)
    if found.carries:
        found = _each_without(found, effects, known)
        found = _without_what_curves_do(found, effects, known)
    if found.selection.effects and found.disturbance is None and not found.carries:
        # What cannot be named must not make a model look worse than it is by itself.
        first = found.selection
        alone = weighed(Selection(first.ladder[:1], first.rankings[:1]))
        return alone if alone.settled or alone.of_curves else found
    return found


def _search(fit: Fit, effects: tuple[Effect, ...], known: Collection[str]) -> Findings:
    def select(fit: Fit, hint: Fit | None = None) -> Selection:
        return select_effects(fit, effects, known, hint)

    if fit.record.pieces is not None:
        return weighed(select(fit))
    size = size_of_misfit(fit)
    coloured = fit.record.noise < WHITE * size.noise
    if coloured and has_passed_a_filter(fit, size):
        return _search_band(within_band(fit, size), select, forced=True)
    disturbance = estimate_disturbance(fit) if size.significant else None
    if coloured and (disturbance is None or lacks_noise(fit, disturbance)):
        return _search_band(within_band(fit, size), select, forced=False)
    if disturbance is None or disturbance.gain < EVIDENCE:
        return weighed(select(fit))
    return _search_beside(fit, disturbance, select)


def _search_band(fit: Fit, select: Callable[..., Selection], *, forced: bool) -> Findings:
    """What is found by what is slow; beside a random force where nothing else explains it.

    Args:
        forced: whether a force may. Of an angle without any noise it would explain all.
    """
    found = weighed(select(fit))
    if found.settled or found.of_curves or not forced:
        return found
    disturbance = estimate_disturbance(fit)
    if disturbance.gain < EVIDENCE:
        return found
    beside = _search_beside(fit, disturbance, select)
    return beside if beside.settled or beside.carries else found


def _search_beside(fit: Fit, disturbance: Disturbance, select: Callable[..., Selection]) -> Findings:
    """What is found beside a random force, or without where none is needed beside the effects found."""
    selection = select(beside_force(fit, disturbance))
    if selection.effects:
        found = replace(selection.fit, record=fit.record)
        hint = better_from_expected(refit(found, found.model, found.free))
        beside = estimate_disturbance(hint)
        if beside.gain < max(EVIDENCE, REST * disturbance.gain):
            # With the effects found no force is needed, or they leave so little to it that another effect may do it:
            # what effects are told apart by is then seen best without one.
            without = weighed(select(fit, hint))
            if beside.gain < EVIDENCE or without.settled or without.of_curves:
                return without
        # Without what the effects explain.
        disturbance = replace(disturbance, emg=beside.emg, response=beside.response)
    return weighed(selection, disturbance)


def _each_without(found: Findings, effects: tuple[Effect, ...], known: Collection[str]) -> Findings:
    """The same, with each effect that was added weighed beside the others, and what would do as well."""
    stand_ins, beside = {}, {}
    selection = found.selection
    first, last = selection.ladder[0], selection.fit
    for effect in last.model.effects[len(first.model.effects) :]:
        try:
            key = frozenset(e.name for e in last.model.effects) - {effect.name}
            without, earlier = selection.weighed.get(key, (None, []))
            if without is None:
                without = without_effect(last, effect, selection.visited)
            with_it = {effect.name: last}
            ranking = rank_effects(without, effects, known, with_it, refits=False, earlier=earlier)
        except FAILURES:  # nothing moves without it
            continue
        own = next(c for c in ranking if c.name == effect.name)
        if own.fit is not None:
            beside[effect.name] = own
        whole = own.fit is not None and last.record.pieces is None
        stand_ins[effect.name] = find_stand_ins(without, own, ranking) if whole else StandIns()
    if len(stand_ins) > 1 and last.record.pieces is None:
        alone = find_stand_ins_for_all(first, last, selection.rankings[0])
        stand_ins = {name: others.or_instead_of_all(alone) for name, others in stand_ins.items()}
    return replace(found, stand_ins=stand_ins, beside=beside)


def _without_what_curves_do(found: Findings, effects: tuple[Effect, ...], known: Collection[str]) -> Findings:
    """The same less the effects that are not evident where curves are free, if another is, and what they leave goes
    with curves: one shape of the curves may ask for several effects that are not there."""
    idle = [name for name, others in found.stand_ins.items() if others.curves]
    if found.disturbance is not None or not 0 < len(idle) < len(found.stand_ins):
        return found
    try:
        less = weighed(without_some(found.selection, idle, effects, known))
    except FAILURES:
        return found
    return _each_without(less, effects, known) if less.of_curves else found


def better_from_expected(fit: Fit) -> Fit:
    """The fit, or that of the same model from where constants are expected: a fit without an effect leads them into
    valleys that one with it need not leave."""
    other = attempt_fit(lambda: fit_from(fit.model, fit.record, fit.free, fit.expected[None]))
    return fit if other is None else min(fit, other, key=lambda each: each.objective)


def within_band(fit: Fit, size: Size) -> Fit:
    """The fit of the same model to what is slow: the angle has passed a filter, which lets the motion through and
    changes what is above."""
    record = replace(
        fit.record, filter=MotionBand.of(fit.record.valid, ABOVE[0] * size.edge_hz * fit.record.dt), noise=size.noise
    )
    return refit(replace(fit, record=record), fit.model, fit.free)


def beside_force(fit: Fit, disturbance: Disturbance) -> Fit:
    """The fit of the same model that takes a random force for a part of the noise."""
    emg = torch.from_numpy(expected_excitation(fit.record.emg.numpy(), fit.record.valid, disturbance.emg))
    record = replace(fit.record, emg=emg, filter=disturbance.whitener, noise=disturbance.angle)
    return refit(replace(fit, record=record), fit.model, fit.free)


def weighed(selection: Selection, disturbance: Disturbance | None = None) -> Findings:
    """What a selection leaves, beside a random force or without one."""
    fit, size = selection.fit, size_of_misfit(selection.fit)
    beside = None if disturbance is None else _size_beside(fit, disturbance)
    repeated = repeated_misfit(fit, beside or size)
    # Beside an effect whatever is left counts against it; a model without any may leave next to nothing.
    noise = min(size.noise, max(fit.rmse(), np.radians(SMALLEST_NOISE_DEG)))
    nothing = 0.0 if selection.effects or beside is not None else NOTHING * noise
    repeats = repeated.significant and repeated.size(fit) > nothing
    if beside is None:
        settled = not repeats and not (size.significant and size.missing > nothing)
        of_curves = not settled and _goes_with_curves(fit, size)
        return Findings(selection, size, size.certain, repeated, settled=settled, of_curves=of_curves)
    repeats = repeats and repeated.gain > ROUGHLY * repeated.freedom
    slow = beside.certain if beside.significant and beside.ratio > ROUGHLY else 0.0
    return Findings(selection, size, slow, repeated, disturbance, not (slow or repeats))


def _size_beside(fit: Fit, disturbance: Disturbance) -> Size:
    """How large what a fit leaves beside a random force is; in a band, beside the noise that was seen above it."""
    known = disturbance.angle if isinstance(fit.record.filter, MotionBand) else None
    return size_of(fit.normal.residual, fit.angle, fit.record, fit.normal.fitted, known)


def _goes_with_curves(fit: Fit, size: Size) -> bool:
    """Whether a fit that leaves more than noise would leave no more with muscle curves of another shape, and what these
    explain is worth their freedom."""
    if fit.record.pieces is not None:
        return False
    curves = freed(fit, size.noise**2)
    # Behind a filter normal equations hold only what is slow, and the noise is seen above.
    residual = fit.residual + curves.normal.residual - fit.normal.residual
    left = size_of(residual, fit.angle, fit.record, curves.normal.fitted)
    samples = fit.record.samples / correlation_time(curves.normal.residual, fit.record.samples)
    worth = delta_bic(fit, fit.objective - curves.drop, 0, samples) - curves.occam
    return worth > EVIDENCE and not left.significant and not repeated_misfit(fit, left, curves.normal).significant
