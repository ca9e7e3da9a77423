"""A parameter that ended at a bound is told, unless that says no more than that an effect is there or is not."""

from dataclasses import replace

import numpy as np
import pytest

from myowave.diagnosis.report.facts import parameters_of
from myowave.identification.free_parameters import free_parameters
from myowave.identification.output_error import begin_from
from myowave.identification.record import make_record
from myowave.settings import Identify


@pytest.mark.parametrize(
    ("effect", "at", "told"),
    [
        ("", {"f0_Bi": 300.0}, {"f0_Bi"}),  # the default, too, may be a bound
        ("", {"f0_Bi": 290.0}, set()),
        ("hand_load", {"hand_load.m": 0.0}, set()),
        ("hand_load", {"hand_load.m": 5.0}, {"hand_load.m"}),
        ("millard_curves", {"millard_curves.w": 1.0}, set()),
    ],
)
def test_what_ended_at_a_bound_is_told(make_trials, base, effects, effect, at, told):
    model = base.with_effects([effects[effect]] if effect else [])
    free = free_parameters(model, {"f0_Bi": Identify(low=150.0, high=300.0)}, {}, {})
    fit = begin_from(model, make_record(make_trials(), model).train, free, np.array([[p.start for p in free]]))[0]
    ended = replace(fit, values=np.array([at.get(p.name, (p.low + p.high) / 2) for p in free]))
    facts = parameters_of(ended, dict.fromkeys(ended.parameters, (1.0, 1.0)))
    assert {name for name, p in facts.items() if p["at_bound"]} == told
