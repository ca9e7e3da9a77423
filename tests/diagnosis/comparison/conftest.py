"""Models with the very parameters that the trials of `make_trials` were simulated with."""

from collections.abc import Callable

import pytest

from myowave.data.trials import Trials
from myowave.identification.along import Along
from myowave.identification.record import make_record
from myowave.physics.model import Model


@pytest.fixture(scope="session")
def true_model(base, effects) -> Callable[[dict], tuple[Model, dict]]:
    """The model with hidden effects {effect: {parameter: value}} and their true values."""

    def make(hidden: dict) -> tuple[Model, dict]:
        values = {f"{effect}.{name}": value for effect, named in hidden.items() for name, value in named.items()}
        return base.with_effects(effects[name] for name in hidden), values

    return make


@pytest.fixture(scope="session")
def along(base, true_model) -> Callable[..., Along]:
    """A model along trials whose angle has no noise; the base model if no effects are given."""

    def make(trials: Trials, hidden: dict | None = None) -> Along:
        model, values = true_model(hidden or {})
        return Along(model, make_record(trials, base, 0.05), values)

    return make
