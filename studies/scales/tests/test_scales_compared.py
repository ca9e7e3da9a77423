"""The comparison of ways: each differs in one thing and has the same steps; pairs of draws are judged."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from myowave.data.store import write_trials
from myowave.data.wavelets import project
from myowave.settings import Physics, RolloutRecipe, SimulatedDataset
from studies.scales.compete import compete
from studies.scales.draws import average_down, decimate, draw_trials, hold_out_others
from studies.scales.figures import draw_comparison
from studies.scales.judge import judge
from studies.scales.page import answer, write_page
from studies.scales.ways import WAYS

SEVERAL = [name for name, way in WAYS.items() if name not in ("one", "one_long")]


def simulated(**changes) -> SimulatedDataset:
    return SimulatedDataset(**({"kind": "simulated", "trials": 3, "samples": 120, "test": ("3",)} | changes))


@pytest.fixture(scope="module")
def physics(settings) -> Physics:
    return settings.physics_of("case1")


@pytest.mark.parametrize("name", WAYS)
def test_the_last_stage_trains_on_the_trials_as_recorded_but_from_fine_to_coarse(name, trials):
    stages = WAYS[name].stages(trials, 3)
    assert sorted(stages) == list(range(3 if name in SEVERAL else 1))
    as_recorded = stages[2 if name == "fine_to_coarse" else 0]
    np.testing.assert_array_equal(as_recorded.angle, trials.angle)
    np.testing.assert_array_equal(as_recorded.emg, trials.emg)
    assert all(stage.test == trials.test for stage in stages.values())


def test_stages_are_what_their_titles_say(trials):
    emg, angle = trials.emg[0, :, 0], trials.angle[0]
    coarse = {name: WAYS[name].stages(trials, 3)[2] for name in WAYS if name in SEVERAL}
    np.testing.assert_allclose(coarse["coarse_to_fine"].emg[0, :, 0], project(emg, 2), atol=1e-12)
    np.testing.assert_allclose(coarse["coarse_to_fine"].angle[0], project(angle, 2), atol=1e-12)
    np.testing.assert_array_equal(coarse["emg_only"].angle, trials.angle)
    np.testing.assert_array_equal(coarse["angle_only"].emg, trials.emg)
    np.testing.assert_allclose(coarse["decimated"].angle[0], project(angle, 2)[::4], atol=1e-12)
    assert coarse["decimated"].dt == pytest.approx(4 * trials.dt)
    # Both leave about as much of white noise; the Gaussian does it without wavelets.
    noise = replace(trials, emg=np.random.default_rng(0).standard_normal(trials.emg.shape))
    left = [WAYS[name].stages(noise, 3)[2].emg.std() for name in ("coarse_to_fine", "gaussian")]
    assert left[0] == pytest.approx(left[1], rel=0.35) and left[1] < 0.7
    assert np.abs(WAYS["gaussian"].stages(noise, 3)[2].emg - coarse["coarse_to_fine"].emg).max() > 0.1


def test_arms_have_the_same_steps_and_the_long_ones_as_many_times_more(trials, model):
    recipe = RolloutRecipe(hidden=4, epochs=12, rollout_s=0.3, simulated_trials=0, patience=1)
    recipe = recipe.model_copy(update={"learning_rate": 1e-12})  # so that validation never improves
    scores = pd.concat(compete(trials, model, recipe, scales=3, seeds=(0, 1)))
    steps = scores.groupby("way")["steps"].first().to_dict()
    assert steps == {name: 36 if way.times else 12 for name, way in WAYS.items()}
    assert scores.groupby("way").size().eq(2).all()
    of_scores = np.degrees(np.sqrt((1 - scores["test_r2"]) * np.var(trials.angle[2, 4:])))
    np.testing.assert_allclose(scores["test_rmse_deg"], of_scores)


def test_arms_are_told_the_load_where_it_differs_between_trials(trials, model):
    loads = {"1": {"load": 0.5}, "2": {"load": 0.0}, "3": {"load": 0.2}}
    recipe = RolloutRecipe(hidden=4, epochs=2, rollout_s=0.3, simulated_trials=0)

    def errors(conditions):
        scores = compete(replace(trials, conditions=conditions), model, recipe, scales=2, seeds=(0,), names=["one"])
        return next(scores)["test_rmse_deg"].to_list()

    assert errors(loads) != errors({**loads, "3": {"load": 0.4}})  # of the test trial


def test_another_draw_is_another_motion_and_what_is_unseen_is_without_noise(model, physics):
    dataset = simulated(angle_noise_deg=3.0)
    first, again, second = (draw_trials("case", dataset, model, physics, [], n, None) for n in (0, 0, 1))
    np.testing.assert_array_equal(first.angle, again.angle)
    assert np.abs(first.emg - second.emg).max() > 0.1
    clean = draw_trials("case", simulated(), model, physics, [], 0, None)
    np.testing.assert_array_equal(first.angle[2], clean.angle[2])
    assert np.degrees(first.angle[:2] - clean.angle[:2]).std() == pytest.approx(3.0, rel=0.15)


def test_wide_band_emg_is_carried_by_the_drive_that_moves_the_arm(model, physics):
    drive, wide = (
        draw_trials("case", simulated(emg_noise=0.0, samples=600, recorded_as=kind), model, physics, [], 0, None)
        for kind in ("envelope", "rectified")
    )
    np.testing.assert_array_equal(wide.angle, drive.angle)
    ratio = wide.emg / drive.emg
    assert ratio.mean() == pytest.approx(1.0, abs=0.03) and ratio.std() == pytest.approx(0.756, abs=0.04)
    assert abs(np.corrcoef(ratio[0, 1:, 0], ratio[0, :-1, 0])[0, 1]) < 0.15


def test_other_recorded_trials_test_in_other_draws_one_for_each_load(trials, model, physics, tmp_path):
    names = tuple("abcdef")
    six = replace(
        trials,
        names=names,
        emg=np.concatenate([trials.emg] * 2),
        angle=np.concatenate([trials.angle] * 2),
        lengths=trials.lengths * 2,
        test=("a",),
        conditions={name: {"load": 1.0 if name < "d" else 2.0, "tilt": 0.01 * i} for i, name in enumerate(names)},
    )
    tests = [hold_out_others(six, draw).test for draw in range(9)]
    assert len(set(tests)) == 9
    assert all(len([n for n in test if n < "d"]) == len([n for n in test if n >= "d"]) == 1 for test in tests)
    path = tmp_path / "trials.parquet"
    write_trials(six, path)
    recorded = draw_trials("case", None, model, physics, [str(path)], 3, 10.0)
    assert recorded.test == tests[3] and recorded.dt == pytest.approx(3 * trials.dt)


def test_averages_and_every_second_sample(trials):
    np.testing.assert_allclose(average_down(trials, 3).angle[0, 1], trials.angle[0, 3:6].mean())
    np.testing.assert_array_equal(decimate(trials, 2).angle[1], trials.angle[1, ::2])
    assert average_down(trials, 3).lengths == tuple(n // 3 for n in trials.lengths)


def scores_with(change: float, scatter: float = 0.02, draws: int = 8, dataset: str = "smooth") -> pd.DataFrame:
    """Scores of two ways whose error differs by a factor, give or take `scatter`, beside a scatter of draws common to
    both that is much larger."""
    random = np.random.default_rng(0)
    rows = []
    for draw in range(draws):
        error = 5.0 * np.exp(random.normal(0.0, 1.0))
        for way, factor in (("restarted", 1.0), ("coarse_to_fine", 1 + change)):
            for seed in range(3):
                rmse = error * factor * np.exp(random.normal(0.0, scatter))
                run = {"condition": "rollout", "dataset": dataset, "draw": draw, "way": way, "seed": seed}
                rows.append(run | {"test_r2": 0.9, "test_rmse_deg": rmse, "steps": 10, "seconds": 1.0})
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("change", "scatter", "finding"),
    [
        (-0.2, 0.02, "helps"),
        (0.2, 0.02, "harms"),
        (-0.2, 1.0, "no clear difference"),
        (0.0, 0.0, "no clear difference"),
    ],
)
def test_arms_are_judged_in_pairs_of_draws(change, scatter, finding):
    judged = judge(scores_with(change, scatter))
    (row,) = judged.itertuples()
    assert (row.way, row.against, row.finding, row.draws) == ("coarse_to_fine", "restarted", finding, 8)
    assert row.low_pct <= row.change_pct <= row.high_pct
    if scatter < 0.1:
        assert row.change_pct == pytest.approx(100 * change, abs=3)


def test_intervals_are_wider_the_more_arms_are_compared():
    two = scores_with(-0.2, 0.1)
    third = two[two["way"] == "coarse_to_fine"].assign(way="gaussian")
    alone, among = (judge(each).set_index("way").loc["coarse_to_fine"] for each in (two, pd.concat([two, third])))
    assert among["change_pct"] == pytest.approx(alone["change_pct"])
    assert among["high_pct"] - among["low_pct"] > 1.1 * (alone["high_pct"] - alone["low_pct"])


def test_a_single_draw_decides_nothing():
    assert judge(scores_with(-0.9, draws=1))["finding"].tolist() == ["no clear difference"]


def test_page_and_picture_say_where_more_scales_help():
    scores = pd.concat([scores_with(-0.3), scores_with(0.3, dataset="wide_band")])
    judged = judge(scores)
    text = answer(judged)
    assert "helps in smooth" in text and "harms in wide_band" in text
    study = {"scales": 3, "conditions": {"rollout": {"recipe": "rollout", "changes": {"epochs": 10}}}}
    page = write_page(judged, scores, study, "mine.png")
    assert text in page and "8 draws" in page and "(mine.png)" in page and "epochs 10" in page
    rows = [line for line in page.splitlines() if line.startswith("|")]
    assert len(rows) == 4 and len({row.count("|") for row in rows}) == 1
    figure = draw_comparison(judged)
    assert [axis.get_title() for axis in figure.axes] == ["smooth", "wide_band"]
    assert text == figure.get_suptitle()
