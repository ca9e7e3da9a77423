"""What the evidence allows to say, and not more."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from myowave.diagnosis.causes import EMG_NOISE
from myowave.diagnosis.misfit.size import size_of_misfit
from myowave.diagnosis.search.conclude import Findings
from myowave.identification.output_error import Fit

Kind = Literal["adequate", "effect", "class", "partial", "unknown", "undecidable"]

CERTAINLY_OUTSIDE = 2.0  # standard errors


@dataclass(frozen=True)
class Verdict:
    """The answer.

    Args:
        kind: adequate; effect (named ones, and nothing is left but noise); class (some cannot be told apart); partial
            (named, while something else is missing); unknown (something is missing that no effect explains);
            undecidable (a parameter may hide an effect).
        effects: named, in the order they were added.
        alternatives: for each named effect that others stand in for equally well, all of them.
        stand_ins: for each named effect, what the catalogue does not hold and that would do as well, in words.
        nearest: effects that come nearest where none is named.
        absorbed: effects that no such data can show: {effect: the parameters that take their place}.
        explained: what the effects explain of it and of what is left [-].
        structure_left: whether more is left than noise.
        of_curves: whether what is left goes with muscle curves of another shape than the settings or an effect allow.
        missing: how much [rad, root mean square]; 0 where nothing is.
        emg_noise: of the recorded EMG [-], where it explains what effects do not; 0 where there is no need for it.
        emg_motion: how far that noise takes the simulated motion from the measured one [rad, root mean square].
        masked: with undecidable, {parameter outside its usual range: effects that would explain it}.
        follows: whether the base model, or one with effects, follows the trials at all; where none does, none is named.
    """

    kind: Kind
    effects: tuple[str, ...]
    alternatives: tuple[tuple[str, ...], ...]
    stand_ins: Mapping[str, tuple[str, ...]]
    nearest: tuple[str, ...]
    absorbed: Mapping[str, tuple[str, ...]]
    explained: float
    structure_left: bool
    missing: float
    emg_noise: float
    masked: Mapping[str, tuple[str, ...]]
    follows: bool = True
    emg_motion: float = 0.0
    of_curves: bool = False

    @property
    def causes(self) -> tuple[str, ...]:
        """All that is named: effects, and noise of the EMG."""
        return (*self.effects, *((EMG_NOISE,) if self.emg_noise else ()))


def judge(found: Findings, *, follows: bool = True) -> Verdict:
    """Weigh what the search found.

    Args:
        follows: see `Verdict`.
    """
    selection, fit = found.selection, found.selection.fit
    absorbed = {c.name: c.score.absorbed_by for c in selection.rankings[-1] if c.score.absorbed}
    alternatives = tuple(c for c in selection.classes.values() if len(c) > 1)
    left = not found.left.only_noise or not follows or (bool(selection.effects) and not found.reportable)
    masked = _masked(fit, absorbed)
    emg = found.disturbance.emg if found.disturbance is not None and not left else 0.0
    named = selection.effects
    stand_ins = {effect: others.names for effect, others in found.stand_ins.items() if others.names}
    kind: Kind
    if left:
        kind = "partial" if named and follows and found.reportable else "unknown"
    elif named or emg:
        kind = "class" if alternatives or stand_ins else "effect"
    else:
        kind = "undecidable" if masked else "adequate"
    unnamed = kind == "unknown"
    # Where something outside the catalogue does better than an effect, that is missing, and no rest beside the effect.
    refuted = any(others.better for others in found.stand_ins.values())
    missing = found.left.missing(fit)
    missing = max(missing, size_of_misfit(selection.ladder[0]).missing) if refuted else missing
    return Verdict(
        kind=kind,
        effects=() if unnamed else named,
        alternatives=() if unnamed else alternatives,
        stand_ins={} if unnamed else stand_ins,
        nearest=named if unnamed else (),
        absorbed=absorbed,
        explained=found.explained,
        structure_left=left,
        missing=missing if left else 0.0,
        emg_noise=emg,
        masked=masked,
        follows=follows,
        emg_motion=found.disturbance.motion if found.disturbance is not None and emg else 0.0,
        of_curves=left and found.left.of_curves,
    )


def _masked(fit: Fit, absorbed: Mapping[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    """Parameters outside the range where their searches start, with the effects that may have moved them there.

    An absorbed effect changes no motion, only the parameters. Nothing but what is known of these can betray it.
    """
    errors = fit.standard_errors()
    found = {}
    for p, value in zip(fit.free, fit.values, strict=True):
        beyond = abs(value - p.start) - p.spread * abs(p.start)
        names = tuple(effect for effect, by in absorbed.items() if p.name in by)
        if p.spread > 0 and names and beyond > CERTAINLY_OUTSIDE * errors[p.name]:
            found[p.name] = names
    return found
