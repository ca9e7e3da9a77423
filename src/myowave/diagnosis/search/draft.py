"""No effect of the catalogue explains what is left: a short formula for the missing torque, as an effect that runs.

The formula is a sum of few terms from a small library, one after the other, each fitted as an effect on the joint and
taken where the evidence is for it: nothing is differentiated, and what the parameters already explain is not explained
twice.
"""

import math
from dataclasses import dataclass
from functools import partial

import torch
from torch import Tensor

from myowave.diagnosis.causes import SURE
from myowave.diagnosis.likelihood.algebra import weigh_components
from myowave.diagnosis.likelihood.components import MISSING, residual_of
from myowave.diagnosis.likelihood.terms import OF_ACTIVATION, OF_MOTION, OfJoint
from myowave.diagnosis.likelihood.waves import View
from myowave.diagnosis.search.score import score_effects
from myowave.identification.output_error import Fit, polish
from myowave.identification.stages import attempt_fit
from myowave.physics.effect import Effect, Parameter
from myowave.physics.effects.coulomb_friction import STICTION

MOST_TERMS = 3
LARGEST = 50.0  # coefficient
TRIED = 3  # terms of the best scores that are fitted before one is taken


@dataclass(frozen=True)
class Term:
    """One term of the library: how it is written in a file, for people, its function of (q, qdot, a), and the unit of
    its coefficient."""

    name: str
    code: str
    text: str
    function: OfJoint
    unit: str = "N m"

    @property
    def effect(self) -> Effect:
        """The term as an effect on the joint, with a coefficient c."""

        def torque(q: Tensor, qdot: Tensor, activation: Tensor, *, c: Tensor) -> Tensor:
            # Where there are no muscles the mean is 0.
            return c * self.function(q, qdot, activation.sum(-1) / max(activation.shape[-1], 1))

        c = Parameter(self.unit, low=-LARGEST, high=LARGEST, typical=0.5, meaning="coefficient")
        return Effect(
            f"draft_{self.name}", "joint", f"c {self.text}".rstrip(), torque, {"c": c}, source="a term of a draft"
        )


def _stop(q: Tensor, v: Tensor, a: Tensor) -> Tensor:
    return torch.exp((-10 * q).clamp(max=5))


# `a` is the mean activation of all muscles.
LIBRARY = (
    Term("constant", "torch.ones_like(q)", "", OF_MOTION["1"]),
    Term("angle", "q", "q", OF_MOTION["q"], "N m/rad"),
    Term("angle_squared", "q**2", "q^2", OF_MOTION["q^2"], "N m/rad^2"),
    Term("sine", "torch.sin(q)", "sin(q)", lambda q, v, a: torch.sin(q)),
    Term("cosine", "torch.cos(q)", "cos(q)", lambda q, v, a: torch.cos(q)),
    Term("velocity", "qdot", "qdot", OF_MOTION["qdot"], "N m s/rad"),
    Term("drag", "qdot * qdot.abs()", "qdot |qdot|", OF_MOTION["qdot |qdot|"], "N m s^2/rad^2"),
    Term("friction", f"torch.tanh(qdot / {STICTION})", f"tanh(qdot/{STICTION})", OF_MOTION["the sign of qdot"]),
    Term("angle_velocity", "q * qdot", "q qdot", OF_MOTION["q qdot"], "N m s/rad^2"),
    Term("activation", "a", "a", OF_ACTIVATION[""]),
    Term("activation_angle", "a * q", "a q", OF_ACTIVATION[" q"], "N m/rad"),
    Term("activation_velocity", "a * qdot", "a qdot", OF_ACTIVATION[" qdot"], "N m s/rad"),
    Term("stop_extended", "torch.exp((-10 * q).clamp(max=5))", "exp(-10 q)", _stop),
)


PRIOR = -math.log(2 * len(LIBRARY))  # how likely a term is before any trial, as an effect of such a catalogue


@dataclass(frozen=True)
class Draft:
    """A formula for what is missing."""

    terms: tuple[tuple[Term, float, float], ...] = ()  # of the library, each with its coefficient and standard error

    @property
    def formula(self) -> str:
        """Their sum as it is written for people; "0" where there are none."""
        return " ".join(f"{value:+.3g} {term.text}".rstrip() for term, value, _ in self.terms) or "0"


def draft_effect(fit: Fit, view: View) -> Draft:
    """Describe what a fitted model still misses by a few terms of the library."""
    chosen: list[Term] = []
    current, likely, library = fit, _log_evidence(fit, view), {f"draft_{term.name}": term for term in LIBRARY}
    while len(chosen) < MOST_TERMS:
        scores = score_effects(current, (term.effect for term in LIBRARY))
        sound = sorted((s for s in scores.values() if not s.absorbed and not s.failure), key=lambda s: -s.drop)
        fits = [(s.effect, attempt_fit(partial(polish, s.start))) for s in sound[:TRIED]]
        tried = [(_log_evidence(found, view), name, found) for name, found in fits if found is not None]
        with_it, name, better = max(tried, key=lambda found: found[0], default=(-math.inf, "", fit))
        if with_it + PRIOR - likely < SURE:
            break
        chosen.append(library[name])
        current, likely = better, with_it
    values, errors = current.parameters, current.standard_errors()
    return Draft(tuple((t, values[f"draft_{t.name}.c"], errors[f"draft_{t.name}.c"]) for t in chosen))


def _log_evidence(fit: Fit, view: View) -> float:
    """How likely a fit is where all that is more than noise is left to the terms [nats]."""
    return max(state.value for state in weigh_components(residual_of(fit, view).without(MISSING)).values())
