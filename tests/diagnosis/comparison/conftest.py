"""Models with the very parameters that the trials of `make_trials` were simulated with."""

from collections.abc import Callable

import pytest

from myowave.data.trials import Trials
from myowave.diagnosis.comparison.measured import Along, Fitted, Measured


@pytest.fixture(scope="session")
def true_model(base, effects) -> Callable[[dict], Fitted]:
    """The model with hidden effects {effect: {parameter: value}} and their true values."""

    def make(hidden: dict) -> Fitted:
        values = {f"{effect}.{name}": value for effect, named in hidden.items() for name, value in named.items()}
        return Fitted(base.with_effects(effects[name] for name in hidden), values)

    return make


@pytest.fixture(scope="session")
def along(base, true_model) -> Callable[..., Along]:
    """A model along trials whose angle has no noise; the base model if no effects are given."""

    def make(trials: Trials, hidden: dict | None = None) -> Along:
        return Along(Measured.of(trials, base, 0.05), true_model(hidden or {}))

    return make
