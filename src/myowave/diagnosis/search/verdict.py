"""What the evidence allows to say, and not more."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from myowave.diagnosis.causes import EMG_NOISE, EMG_NOISE_TITLE, OF_RECORDER, OUTSIDE, OWN_CURVES
from myowave.diagnosis.search.answer import Answer, Kind
from myowave.diagnosis.search.ladder import Ladder
from myowave.identification.output_error import Fit

# What may stand in for an effect, in words.
STAND_INS = {OUTSIDE: "something like it", OWN_CURVES: OWN_CURVES, EMG_NOISE: EMG_NOISE_TITLE}
CERTAINLY_OUTSIDE = 2.0  # standard errors


@dataclass(frozen=True)
class Verdict:
    """The answer."""

    # adequate; effect (named ones, and nothing is left but noise); class (some cannot be told apart); partial (named,
    # while something else is missing); unknown (something is missing that no effect explains); undecidable (a parameter
    # may hide an effect)
    kind: Kind
    effects: tuple[str, ...]  # named, in the order they were added
    # for each named effect that others stand in for equally well, all of them
    alternatives: tuple[tuple[str, ...], ...]
    nearest: tuple[str, ...]  # effects that come nearest where none is named
    # effects that no such data can show: {effect: the parameters that take their place}
    absorbed: Mapping[str, tuple[str, ...]]
    explained: float  # what the effects explain of it and of what is left [-]
    structure_left: bool  # whether more is left than noise
    missing: float  # how much [rad, root mean square]; 0 where nothing is
    # with undecidable, {parameter outside its usual range: effects that would explain it}
    masked: Mapping[str, tuple[str, ...]]
    # for each named effect, what the catalogue does not hold and that would do as well, in words
    stand_ins: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    # of the recorded EMG [-], where it explains what effects do not; 0 where there is no need for it
    emg_noise: float = 0.0
    # whether the base model, or one with effects, follows the trials at all; where none does, none is named
    follows: bool = True
    # how far that noise takes the simulated motion from the measured one [rad, root mean square]
    emg_motion: float = 0.0
    # whether what is left goes with muscle curves of another shape than the settings or an effect allow
    of_curves: bool = False
    recorder: tuple[str, ...] = ()  # what else the recorder did, of `diagnosis.causes`
    # of every name that was weighed, see `answer.Answer`
    probabilities: Mapping[str, float] = field(default_factory=dict)

    @property
    def causes(self) -> tuple[str, ...]:
        """All that is named: effects, noise of the EMG, and what else the recorder did."""
        return (*self.effects, *((EMG_NOISE,) if self.emg_noise else ()), *self.recorder)


def judge(answer: Answer, ladder: Ladder, *, follows: bool = True) -> Verdict:
    """What pages and scoring are told."""
    absorbed = {c.name: c.score.absorbed_by for c in ladder.rankings[-1] if c.score.absorbed}
    if not follows:
        nearest = answer.best.effects
        return Verdict("unknown", (), (), nearest, absorbed, 0.0, True, answer.missing, {}, follows=False)
    effects = tuple(name for name in ladder.effects if any(name in members for members in answer.named))
    own = {name: next(members for members in answer.named if name in members) for name in effects}
    kind: Kind = answer.kind
    masked = _masked(ladder.fit, absorbed) | answer.unusual
    if kind == "adequate" and masked:
        kind = "undecidable"
    left = kind in ("partial", "unknown") or answer.of_curves
    if answer.of_curves:
        kind = "partial" if effects else "unknown"
    return Verdict(
        kind=kind,
        effects=effects,
        alternatives=tuple(c for name, c in ladder.classes.items() if name in effects and len(c) > 1),
        stand_ins={
            name: tuple(STAND_INS[other] for other in members if other in STAND_INS)
            for name, members in own.items()
            if any(other in STAND_INS for other in members)
        },
        nearest=() if kind != "unknown" else answer.best.effects,
        absorbed=absorbed,
        explained=_explained(ladder, answer),
        structure_left=left,
        missing=answer.missing if left else 0.0,
        emg_noise=answer.emg_noise,
        masked=masked if kind == "undecidable" else {},
        emg_motion=answer.emg_motion,
        of_curves=answer.of_curves,
        recorder=tuple(c for c in OF_RECORDER if any(c in members for members in answer.named)),
        probabilities=answer.probabilities,
    )


def _explained(ladder: Ladder, answer: Answer) -> float:
    """What the effects found explain, as a share of it and of what is left [-]."""
    gained = ladder.fits[0].objective - ladder.fit.objective
    left = answer.missing**2 * ladder.fit.record.samples
    return float(gained / max(gained + left, 1e-300)) if gained > 0 else 0.0


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
