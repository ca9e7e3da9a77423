"""Other trials held out in turn: what trains and what tests, and the table over them."""

import pandas as pd
import pytest

from studies.held_out.table import hold_out, tabulate_scales, write_page


def test_other_trials_test_and_the_rest_train(trials):
    other = hold_out(trials, ("1",))
    assert other.test == ("1",) and other.train == ("2", "3")
    assert other.angle is trials.angle


@pytest.mark.parametrize(("test", "says"), [(("1", "2", "3"), "names every trial"), (("9",), "no trial named")])
def test_a_choice_that_leaves_nothing_or_names_nothing_is_refused(trials, test, says):
    with pytest.raises(ValueError, match=says):
        hold_out(trials, test)


@pytest.fixture
def scores() -> pd.DataFrame:
    rows = [(1, "a", 0.90), (1, "a", 0.92), (1, "b", 0.70), (1, "b", 0.74), (3, "a", 0.97), (3, "a", 0.97)]
    rows += [(3, "b", 0.95), (3, "b", 0.95)]
    return pd.DataFrame(rows, columns=["scales", "held_out", "test_r2"])


def test_scatter_of_seeds_and_of_trials_are_told_apart(scores):
    one, three = tabulate_scales(scores).to_dict("records")
    assert one["mean"] == pytest.approx(0.815) and (one["lowest"], one["highest"]) == (0.70, 0.92)
    assert one["sd_seeds"] == pytest.approx(((0.01**2 * 2 + 0.02**2 * 2) / 2) ** 0.5)
    assert one["sd_trials"] == pytest.approx(0.19 / 2**0.5), "of the means 0.91 and 0.72"
    assert three["sd_seeds"] == pytest.approx(0) and (three["a"], three["b"]) == (0.97, 0.95)


def test_the_page_has_a_row_for_each_number_of_scales(scores):
    page = write_page(tabulate_scales(scores), "me", "rollout", 120.0)
    assert "| 1 | 0.815 |" in page and "| 3 | 0.960 |" in page and "2 min of one core" in page
    assert "| a | b |" in page
