"""A set of the study: trials of a case, their first fit, and what of the truth scoring needs.

What was hidden is known here and to `make_trials` only; a judge gets the fit and the catalogue.
"""

import pickle
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from myowave.data.trials import Trials
from myowave.diagnosis.causes import OUTSIDE, OWN_SHAPES
from myowave.diagnosis.scoring import Named
from myowave.identification.free_parameters import Free, free_parameters
from myowave.identification.output_error import Fit, fit_from
from myowave.identification.record import make_record
from myowave.identification.stages import attempt_fit, fit_in_stages
from myowave.physics.effect import Effect
from myowave.physics.model import Model
from myowave.settings import DiagnosisSettings, SimulatedDataset
from studies.verdicts.cases import Case, make_trials
from studies.verdicts.visible import signals_of
from studies.verdicts.worlds import CURVES, HELD_BACK, TRUE, TRUE_OF, draw_world

ATTEMPTS = 3  # to draw an arm that stays in range
ALIKE = {
    "all_at_once": ("other_curves", "other_constants", "other_solver"),
    "other_simulator": ("other_curves",),
    "mujoco": ("other_curves", "other_constants"),
}


@dataclass(frozen=True)
class Drawn:
    """A set."""

    case: Case
    constants: Mapping[str, float]  # of the arm, true values of the model's constants by name
    recording: Mapping[str, float]  # see `World`
    trials: Trials
    free: tuple[Free, ...]  # what is estimated
    starts: int  # guesses that a fit starts from
    values: NDArray[np.float64] | None  # of the first fit, (P,); None where it does not follow whole trials
    signals: Mapping[str, float]  # see `visible.signals_of`

    def known_to(self, catalogue: Mapping[str, Effect]) -> list[Effect]:
        """The catalogue that a judge gets."""
        return [effect for name, effect in catalogue.items() if name not in self.case.taken_out]

    def fit(self, base: Model) -> Fit:
        """The first fit, of the trials that may be fitted."""
        record = make_record(self.trials, base).train
        values = self.values
        kept = None if values is None else attempt_fit(lambda: fit_from(base, record, self.free, values[None]))
        return kept or fit_in_stages(base, record, self.free, starts=self.starts)

    @property
    def wanted(self) -> frozenset[str]:
        """Names that the trials show."""
        seen = frozenset(name for name, signal in self.signals.items() if signal >= 1)
        out = seen & set(self.case.taken_out)
        return (seen - out) | {OWN_SHAPES if name in CURVES else OUTSIDE for name in out}

    @property
    def true(self) -> frozenset[str]:
        """All names that are true of the arm, `OUTSIDE` where something that the catalogue lacks shows."""
        names = (self.wanted | set(self.case.hidden)) - set(self.case.taken_out)
        names = names.union(*(TRUE.get(world, ()) for world in ALIKE.get(self.case.world, (self.case.world,))))
        names = names.union(*(TRUE_OF.get(sensor, ()) for sensor in self.recording))
        if any(self.signals[name] >= 1 for name in self.case.taken_out):
            names |= {OUTSIDE}
        if CURVES & set(self.case.taken_out):  # the others say that curves differ, too
            names |= CURVES
        return names | ({OWN_SHAPES} if CURVES & names else set())

    def graded_as(self, named: Named) -> Named:
        """What is named, where it depends on the arm: any family of curves says that curves differ, where that of the
        arm is in no catalogue; and curves of any shape may be those of any family."""
        if CURVES & set(self.case.taken_out):
            return tuple(tuple(OWN_SHAPES if name in CURVES else name for name in members) for members in named)
        if CURVES & self.wanted:
            families = {OWN_SHAPES: tuple(sorted(CURVES))}
            return tuple(tuple(n for name in members for n in families.get(name, (name,))) for members in named)
        return named


def draw_set(
    case: Case,
    dataset: SimulatedDataset,
    settings: DiagnosisSettings,
    base: Model,
    catalogue: Mapping[str, Effect],
) -> Drawn | None:
    """Make the trials of a case and fit the model to them; None where no EMG keeps any arm in range."""
    for attempt in range(ATTEMPTS):
        case = replace(case, attempt=attempt)
        world = draw_world(case.world, base, settings.scatter, case.random, case.turn)
        made = make_trials(case, world, dataset, catalogue)
        if made is not None:
            break
    else:
        return None
    seen, quiet = (make_record(trials, base).train for trials in made)
    free = displaced(free_parameters(base, dataset.identify, seen.known, settings.scatter), case)
    fit = fit_in_stages(base, seen, free, starts=settings.starts)
    raw = dataset.samples, dataset.dt_s
    signals = signals_of(case.hidden, case.noise_deg, world, raw, fit, quiet, catalogue)
    constants = {**base.defaults, **world.constants}
    if world.sample_and_hold:
        late = HELD_BACK * dataset.dt_s
        constants |= {name: value + late for name, value in constants.items() if name.startswith("delay")}
    values = fit.values if fit.record.pieces is None else None
    return Drawn(case, constants, world.recording, made[0], fit.free, settings.starts, values, signals)


def displaced(free: Sequence[Free], case: Case) -> tuple[Free, ...]:
    """What to estimate, expected where the truth is up to its spread away: nobody knows the values before."""
    random = case.random.spawn(2)[1]
    return tuple(replace(p, start=p.start / (1 + p.spread * random.uniform(-1, 1))) for p in free)


def write_set(drawn: Drawn | None, path: Path) -> None:
    """Keep a set as plain values, which code that has moved can read as well."""
    path.write_bytes(pickle.dumps(None if drawn is None else asdict(drawn)))


def read_set(path: Path) -> Drawn | None:
    """A set that was kept; None where none could be drawn."""
    kept = pickle.loads(path.read_bytes())
    if kept is None:
        return None
    parts = {
        "case": Case(**kept["case"]),
        "trials": Trials(**kept["trials"]),
        "free": tuple(Free(**p) for p in kept["free"]),
    }
    return Drawn(**{**kept, **parts})
