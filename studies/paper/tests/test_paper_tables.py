"""The paper's numbers beside ours: transcribed rightly, averaged over seeds."""

import numpy as np
import pandas as pd
import pytest
import torch

from myowave.identification.free_parameters import free_parameters
from myowave.learning.methods.paper.joint_identification import Form
from myowave.settings import Identify
from studies.paper import tables

SAMPLES = 500


def test_the_printed_errors_are_of_500_samples():
    for nmse, r2 in tables.PRINTED_TEST.values():
        assert nmse == pytest.approx((1 - r2) / SAMPLES, rel=0.01)


def test_a_further_draw_of_a_case_stands_beside_the_case_and_twice_its_error_is_the_bar():
    errors_pct = {"f0_Bi": 1.0 + np.linspace(-0.05, 0.05, 5), "f0_Tri": 0.13, "l0_Bi": 0.0, "l0_Tri": 0.0}
    runs = pd.DataFrame({f"{name}_error_pct": error for name, error in errors_pct.items()})
    runs = pd.concat([runs.assign(scales=3), (runs + 10).assign(scales=1)])
    errors = tables.parameter_errors(runs.assign(dataset="case1_again", recipe="paper"))
    three = errors.set_index("parameter")
    assert three["error_pct"].tolist() == pytest.approx([1.0, 0.13, 0.0, 0.0])
    assert three["paper_error_pct"].to_dict() == {n: tables.PRINTED_ERROR_PCT["case1"][n][0] for n in tables.PARAMETERS}
    assert three["within_twice"].to_dict() == {"f0_Bi": True, "f0_Tri": False, "l0_Bi": True, "l0_Tri": True}


def test_what_eq_41_can_reach_ends_at_the_mean_of_the_literature(model):
    for values in ((4.0, 8.0), (1.0, 2.0, 9.0)):
        wanted = Identify(literature=values)
        (free,) = free_parameters(model, {"f0_Bi": wanted}, ())
        form = Form.of(free, wanted, torch.ones(1))
        low, high = tables.reach(wanted.model_dump())
        ends = torch.tensor([[-40.0] * len(values), [40.0] * len(values)])
        assert form.value(ends).tolist() == pytest.approx([low, high], abs=1e-9)
    assert tables.reach(Identify(low=2.0, high=3.0).model_dump()) == (2.0, 3.0)


def test_seeds_at_the_end_of_their_reach_are_counted():
    bounds = {name: {"low": 10.0, "high": 100.0} for name in tables.PARAMETERS}
    rows = pd.DataFrame({name: [10.1, 13.0, 50.0, 99.5] for name in tables.PARAMETERS}).assign(
        dataset="elbow", scales=1
    )
    values = tables.identified_values(rows, {"elbow": bounds})
    assert set(values["at_limit"]) == {2}
    assert values["value"].tolist() == pytest.approx([43.15] * 4)
