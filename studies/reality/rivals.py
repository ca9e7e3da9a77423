"""What others name on the same trials: a lasso on torque, and PySINDy where it is installed (requirements.txt).

Shapes: T trials, K windows, E effects.
"""

from collections.abc import Mapping
from importlib import import_module

import numpy as np
import torch
from sklearn.linear_model import LassoCV

from myowave.data.trials import Array, Trials
from myowave.identification.along import Along
from myowave.identification.record import Record, make_record
from myowave.identification.torque import TorqueBalance, effects_unseen_by_angle
from myowave.physics.effect import Effect
from myowave.physics.effects.coulomb_friction import grown
from myowave.physics.model import Model

NOT_RUN = "not run"
# Of angle and velocity, by the effect that is such a term of the acceleration.
TERMS = {
    "gravity": lambda q, v: np.sin(q),
    "joint_damping": lambda q, v: v,
    "quadratic_drag": lambda q, v: v * np.abs(v),
    "coulomb_friction": lambda q, v: grown(torch.as_tensor(v)).numpy(),
}
THRESHOLD = 0.1  # of coefficients, as PySINDy has it by default


def lasso(trials: Trials, base: Model, effects: Mapping[str, Effect]) -> list[str]:
    """Effects that a lasso keeps in the torque that the base model leaves of the training trials, the largest first.

    Each effect is what it changes in the torque at its typical strength; the penalty is chosen by cross-validation.
    """
    record = make_record(trials, base).train
    columns, names = [], []
    left = _left(base, record, {})
    for name, effect in effects.items():
        if base.refuses(effect) or effects_unseen_by_angle(model := base.with_effects([effect])):
            continue
        typical = {full: p.typical for full, p in model.parameters_of(effect).items()}
        change = left - _left(model, record, typical)
        if np.isfinite(change).all() and change.std() > 0:
            columns.append(change)
            names.append(name)
    x = np.stack(columns, -1)
    scale = x.std(0)
    found = LassoCV(cv=5, max_iter=50_000).fit(x / scale, left)
    order = np.argsort(-np.abs(found.coef_))
    return [names[i] for i in order if found.coef_[i] != 0]


def _left(model: Model, record: Record, params: Mapping[str, float]) -> Array:
    """Torque that a model leaves in every window of all trials [N m]."""
    balance = TorqueBalance.along(Along(model, record, {}))
    torques = balance.torques(params)
    return (torques.needed - torques.given)[balance.inside]


def pysindy(trials: Trials, base: Model) -> list[str] | str:
    """Terms that PySINDy keeps in the acceleration; of an arm without muscles."""
    if base.muscles:
        return NOT_RUN
    try:
        rival = import_module("pysindy")
    except ImportError:
        return "not installed"
    record = make_record(trials, base).train
    _, q, v = Along(base, record, {}).motion
    lengths = record.lengths
    states = [np.stack([q[i, :n], v[i, :n]], -1) for i, n in enumerate(lengths)]
    motor = trials.select(record.names).signals.get("motor_Nm")
    control = None if motor is None else [motor[i, :n, None] for i, n in enumerate(lengths)]
    functions = list(TERMS.values())
    if control is not None:
        functions = [(lambda q, v, u, term=term: term(q, v)) for term in functions] + [lambda q, v, u: u]
    library = rival.CustomLibrary(library_functions=functions, interaction_only=True)
    model = rival.SINDy(optimizer=rival.STLSQ(threshold=THRESHOLD), feature_library=library)
    model.fit(states, t=record.dt, u=control)
    kept = model.coefficients()[1]
    return [name for name, value in zip(TERMS, kept, strict=False) if value != 0 and name != "gravity"]
