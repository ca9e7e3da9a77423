"""The paper's way to identify: raw numbers that Adam may move anywhere, and values within their limits."""

import pytest
import torch

from myowave.identification.free_parameters import free_parameters, start_values
from myowave.learning.methods.paper.joint_identification import JointIdentification
from myowave.settings import Identify

CPU = torch.device("cpu")


def joint(model, wanted, values=None, seeds=(0, 1)):
    free = free_parameters(model, wanted, ())
    start = torch.from_numpy(start_values(free, seeds))
    return start, JointIdentification(free, wanted, start, start if values is None else values, CPU)


def put(identification, raw):
    with torch.no_grad():
        identification.moved.copy_(torch.as_tensor(raw, dtype=torch.float64).expand_as(identification.moved))
    return identification.values


def test_literature_values_confine_as_printed(model):
    """Eq. 41: anything between 0 and the mean of the literature values, and nothing else."""
    start, identification = joint(model, {"f0_Bi": Identify(literature=(400.0, 800.0))}, seeds=(0,))
    assert identification.moved.shape == (1, 2)
    torch.testing.assert_close(identification.values, start)
    assert abs(start.item() / 300 - 1) <= 0.2
    low, high = (put(identification, sign * 50.0).item() for sign in (-1, 1))
    assert low == pytest.approx(0.0, abs=1e-6) and high == pytest.approx(600.0)
    assert put(identification, [50.0, -50.0]).item() == pytest.approx(200.0)


def test_bounds_are_reached_and_never_passed(model):
    _, identification = joint(model, {"f0_Bi": Identify(low=100.0, high=900.0)})
    for raw, end in ((-40.0, 100.0), (40.0, 900.0)):
        torch.testing.assert_close(put(identification, raw), torch.full((2, 1), end, dtype=torch.float64))


def test_a_ratio_of_1_is_the_start_and_an_effect_starts_at_0(model, effects):
    richer = model.with_effects([effects["joint_damping"]])
    start, identification = joint(richer, {"f0_Bi": Identify()})
    torch.testing.assert_close(identification.moved[:, 0], torch.ones(2, dtype=torch.float64))
    torch.testing.assert_close(identification.values, start)
    assert (start[:, 1] == 0).all()
    typical = effects["joint_damping"].parameters["c"].typical
    torch.testing.assert_close(put(identification, 1.0)[:, 1], torch.full((2,), typical, dtype=torch.float64))
    assert (put(identification, -5.0) == 0).all(), "neither a muscle nor a damper may turn round"


def test_the_next_scale_goes_on_from_the_values(model):
    wanted = {
        "f0_Bi": Identify(),
        "l0_Bi": Identify(low=0.2, high=0.9),
        "f0_Tri": Identify(literature=(200.0, 500.0, 800.0)),
    }
    values = torch.tensor([[250.0, 0.8999, 499.9], [350.0, 0.21, 3.0]], dtype=torch.float64)
    _, again = joint(model, wanted, values)
    torch.testing.assert_close(again.values, values)


def test_a_start_at_the_end_of_its_range_is_brought_inside_where_it_can_move(model):
    _, identification = joint(model, {"f0_Bi": Identify(low=310.0, high=340.0)})
    assert (identification.values > 310.1).all()
    identification.params["f0_Bi"].sum().backward()
    assert (identification.moved.grad > 0.1).all()


def test_gradients_of_a_parameter_reach_its_own_raw_numbers_only(model):
    _, identification = joint(model, {"f0_Bi": Identify(), "f0_Tri": Identify(literature=(200.0, 800.0))})
    identification.params["f0_Tri"][0].sum().backward()
    assert (identification.moved.grad != 0).tolist() == [[False, True, True], [False, False, False]]
