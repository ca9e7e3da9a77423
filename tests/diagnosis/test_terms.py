"""Terms of what a model may lack in general are what they are called."""

import math

import pytest
import torch

from myowave.diagnosis.likelihood.terms import OF_ACTIVATION, OF_MOTION, OF_SENSOR


def test_terms_are_what_they_are_called():
    q, v, a = torch.tensor(0.5), torch.tensor(-2.0), torch.tensor(0.3)
    of_motion = {"1": 1, "q": 0.5, "q^2": 0.25, "sin(2 q)": math.sin(1), "qdot": -2, "qdot |qdot|": -4}
    of_motion |= {"the sign of qdot": -1, "q qdot": -1}
    assert {name: float(term(q, v, a)) for name, term in OF_MOTION.items()} == pytest.approx(of_motion)
    beside = {"": 1, "^2": 0.3, " q": 0.5, " q^2": 0.25, " qdot": -2, " qdot |qdot|": -4, " the sign of qdot": -1}
    found = {name: float(term(q, v, a)) for name, term in OF_ACTIVATION.items()}
    assert found == pytest.approx({name: 0.3 * factor for name, factor in beside.items()})
    of_sensor = {"angle_offset": 1.0, "angle_scale": 0.5, "observation_lag": 2.0}
    assert {name: float(term(q, v, a)) for name, term in OF_SENSOR.items()} == of_sensor
