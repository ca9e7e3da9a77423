"""Search for what a fitted model lacks, given noise of the EMG where it leaves more than noise; see what is left.

Where a model leaves more than the noise of the angle, an effect of the catalogue is missing, or one that is not in it,
or the EMG itself is noisy. The last two push the arm by forces that no model has. So effects are weighed given such a
force, of the size that the residual calls for: one that is named then has evidence that the force cannot take from it.
Where no force is needed beside the effects found, they are weighed again without.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace

import torch

from myowave.diagnosis.evidence import EVIDENCE
from myowave.diagnosis.misfit.filtered import WHITE, has_passed_a_filter, lacks_noise
from myowave.diagnosis.misfit.left import Left, what_is_left
from myowave.diagnosis.misfit.size import Size, size_of_misfit
from myowave.diagnosis.search.rank import Candidate, rank_effects
from myowave.diagnosis.search.score import FAILURES
from myowave.diagnosis.search.selection import Selection, select_effects, without_effect, without_some
from myowave.diagnosis.search.stand_ins import StandIns, find_stand_ins, find_stand_ins_for_all
from myowave.identification.disturbance import Disturbance, estimate_disturbance
from myowave.identification.expected_emg import expected_excitation
from myowave.identification.output_error import Fit, fit_from, refit
from myowave.identification.spectrum import ABOVE
from myowave.identification.stages import attempt_fit
from myowave.identification.whitening import MotionBand
from myowave.physics.effect import Effect

MOST_OF_IT = 0.9  # share that effects must explain to be named where something else is left
REST = 0.1  # share of the evidence for a random force that effects may leave where they are weighed without it


@dataclass(frozen=True)
class Findings:
    """What a search found, and what it leaves.

    Args:
        left: what the last fit leaves, given the random force.
        disturbance: the random force given which effects were weighed; None where none was needed.
        stand_ins: for each effect found, what the catalogue does not hold and that would do as well.
        given_others: each effect found, weighed at the fit with all the others.
    """

    selection: Selection
    left: Left
    disturbance: Disturbance | None = None
    stand_ins: Mapping[str, StandIns] = field(default_factory=dict)
    given_others: Mapping[str, Candidate] = field(default_factory=dict)

    @property
    def explained(self) -> float:
        """What the effects found explain, as a share of it and of what is certainly left [-]."""
        first, last = self.selection.ladder[0], self.selection.fit
        explained = (first.objective - last.objective) / last.independent_variance
        return float(explained / max(explained + self.left.certain, 1e-300)) if explained > 0 else 0.0

    @property
    def reportable(self) -> bool:
        """Whether the effects found may be named: nothing that the catalogue does not hold does better, and nothing
        else is left and no force was needed beside them, or little is left beside what they explain. What goes with
        the shape of the curves may be left beside an effect that is evident whatever their shape."""
        others = self.stand_ins.values()
        if any(other.better for other in others):
            return False
        evident = not others or any(not other.curves for other in others)
        all_told = self.left.only_noise or (self.left.of_curves and evident)
        return (all_told and self.disturbance is None) or self.explained >= MOST_OF_IT


def search(fit: Fit, effects: Iterable[Effect], known: Collection[str] = ()) -> Findings:
    """Find the effects that a fitted model lacks.

    Args:
        effects: the catalogue.
        known: names of parameters that are known and so not to be estimated.
    """
    effects = tuple(effects)
    found = _find(fit, lambda fit, hint=None: select_effects(fit, effects, known, hint))
    if found.reportable:
        found = _weigh_each(found, effects, known)
        found = _without_what_curves_do(found, effects, known)
    if found.selection.effects and found.disturbance is None and not found.reportable:
        # What cannot be named must not make a model look worse than it is by itself.
        first = found.selection
        alone = conclude(Selection(first.ladder[:1], first.rankings[:1]))
        return alone if alone.left.only_noise or alone.left.of_curves else found
    return found


def conclude(selection: Selection, disturbance: Disturbance | None = None) -> Findings:
    """What a selection found, and what it leaves, given a random force or without one."""
    left = what_is_left(selection.fit, disturbance, has_effects=bool(selection.effects))
    return Findings(selection, left, disturbance)


def _find(fit: Fit, select: Callable[..., Selection]) -> Findings:
    """What is found without a random force, by what is slow where the angle has passed a filter; given one where more
    is left than noise."""
    size = size_of_misfit(fit)
    coloured = fit.record.pieces is None and fit.record.noise < WHITE * size.noise
    filtered = coloured and has_passed_a_filter(fit, size)
    force = None
    if fit.record.pieces is None and size.significant and not filtered:
        force = estimate_disturbance(fit)
    found = None
    if filtered or (coloured and (force is None or lacks_noise(fit, force))):
        fit, force = within_band(fit, size), None
    if force is None or force.gain < EVIDENCE:
        found = conclude(select(fit))
        # Of an angle without any noise a force would explain all.
        if not filtered or found.left.only_noise or found.left.of_curves:
            return found
        force = estimate_disturbance(fit)
        if force.gain < EVIDENCE:
            return found
    given = _find_given(force, fit, select)
    return given if found is None or given.left.only_noise or given.reportable else found


def _find_given(force: Disturbance, fit: Fit, select: Callable[..., Selection]) -> Findings:
    """What is found given a random force, or without where none is needed beside the effects found."""
    selection = select(given_force(fit, force))
    if selection.effects:
        found = replace(selection.fit, record=fit.record)
        hint = better_from_expected(refit(found, found.model, found.free))
        rest = estimate_disturbance(hint)
        if rest.gain < max(EVIDENCE, REST * force.gain):
            # With the effects found no force is needed, or they leave so little to it that another effect may do it:
            # what effects are told apart by is then seen best without one.
            without = conclude(select(fit, hint))
            if rest.gain < EVIDENCE or without.left.only_noise or without.left.of_curves:
                return without
        # Without what the effects explain.
        force = replace(force, emg=rest.emg, response=rest.response)
    return conclude(selection, force)


def _weigh_each(found: Findings, effects: tuple[Effect, ...], known: Collection[str]) -> Findings:
    """The same, with each effect that was added weighed given the others, and what would do as well."""
    stand_ins, given_others = {}, {}
    selection = found.selection
    first, last = selection.ladder[0], selection.fit
    whole = last.record.pieces is None
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
            given_others[effect.name] = own
        known_fit = own.fit is not None and whole
        stand_ins[effect.name] = find_stand_ins(without, own, ranking) if known_fit else StandIns()
    if len(stand_ins) > 1 and whole:
        alone = find_stand_ins_for_all(first, last, selection.rankings[0])
        stand_ins = {name: others.or_instead_of_all(alone) for name, others in stand_ins.items()}
    return replace(found, stand_ins=stand_ins, given_others=given_others)


def _without_what_curves_do(found: Findings, effects: tuple[Effect, ...], known: Collection[str]) -> Findings:
    """The same less the effects that are not evident whatever the shape of the curves, if another is, and what they
    leave goes with curves: one shape of the curves may ask for several effects that are not there."""
    idle = [name for name, others in found.stand_ins.items() if others.curves]
    if found.disturbance is not None or not 0 < len(idle) < len(found.stand_ins):
        return found
    try:
        less = conclude(without_some(found.selection, idle, effects, known))
    except FAILURES:
        return found
    return _weigh_each(less, effects, known) if less.left.of_curves else found


def better_from_expected(fit: Fit) -> Fit:
    """The fit, or that of the same model from where constants are expected: a fit without an effect leads them into
    valleys that one with it need not leave."""
    other = attempt_fit(lambda: fit_from(fit.model, fit.record, fit.free, fit.expected[None]))
    return fit if other is None else min(fit, other, key=lambda each: each.objective)


def within_band(fit: Fit, size: Size) -> Fit:
    """The fit of the same model to what is slow: the angle has passed a filter, which lets the motion through and
    changes what is above."""
    band = MotionBand.of(fit.record.valid, ABOVE[0] * size.edge_hz * fit.record.dt)
    record = replace(fit.record, filter=band, noise=size.noise)
    return refit(replace(fit, record=record), fit.model, fit.free)


def given_force(fit: Fit, disturbance: Disturbance) -> Fit:
    """The fit of the same model that takes a random force for a part of the noise."""
    emg = torch.from_numpy(expected_excitation(fit.record.emg.numpy(), fit.record.valid, disturbance.emg))
    record = replace(fit.record, emg=emg, filter=disturbance.whitener, noise=disturbance.angle)
    return refit(replace(fit, record=record), fit.model, fit.free)
