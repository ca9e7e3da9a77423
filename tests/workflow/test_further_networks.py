"""Networks beside those of all datasets: further recipes with scales of their own, and the comparison of arms."""

import pandas as pd

NONE = {"human_curls": None, "wide_band": None, "wide_band_1khz": None, "noisy_angle": None}


def small_comparison(config: dict) -> dict:
    """The comparison on one dataset under one condition, of seconds."""
    others = [name for name in config["learning"]["multiresolution"]["conditions"] if name != "rollout"]
    only = {
        "datasets": ["smooth"],
        "arms": ["one", "restarted", "coarse_to_fine"],
        "changes": {"epochs": 3, "hidden": 4},
    }
    compared = {"draws": 2, "seeds": 2, "datasets": NONE, "conditions": dict.fromkeys(others) | {"rollout": only}}
    return {"data": {"datasets": {"smooth": {"samples": 100}}}, "learning": {"multiresolution": compared}}


def test_a_further_recipe_is_trained_where_it_is_named_with_its_own_numbers_of_scales(project):
    targets = {"datasets": ["case1", "case2"], "scales": [2], "follow_verdict": []}
    without = project.planned(*project.lay_over({"targets": targets}))
    further = {"own_recipes": {"case1": ["rollout", "paper_split"]}, "own_scales": {"paper_split": [1, 3]}}
    planned = project.planned(*project.lay_over({"targets": targets | further}))
    assert without["train_scale"] == 2 * 2 and planned["train_scale"] == 2 * 2 + 1 + 3
    assert planned["evaluate_model"] == 2 + 2 and planned["draw_models"] == 2 + 1
    others = targets | further | {"datasets": ["case2"]}
    assert project.planned(*project.lay_over({"targets": others}))["train_scale"] == 2, "case1 is not made at all"


def test_the_main_job_trains_with_the_papers_own_method(project):
    for scales in (1, 3):
        page = f"results/learning/case1/base/paper_split/{scales}-scale/evaluation.csv"
        assert page in project.snakemake("-n").stdout


def test_a_further_recipe_that_is_not_there_is_refused(project):
    wrong = {"targets": {"own_recipes": {"case1": ["papr"], "case9": ["paper"]}, "own_scales": {"ppr": [1]}}}
    done = project.snakemake("-n", *project.lay_over(wrong))
    assert "targets.own_recipes.case1[0]: there is no 'papr'; did you mean 'paper'?" in done.stdout
    assert "targets.own_recipes.case9: there is no 'case9'" in done.stdout
    assert "targets.own_scales.ppr: there is no 'ppr'" in done.stdout


def test_conditions_of_the_comparison_are_checked_before_anything_runs(project, settings_file):
    wrong = small_comparison(settings_file)
    wrong["learning"]["multiresolution"]["conditions"]["rollout"]["changes"] = {"hiden": 3}
    done = project.snakemake("-n", *project.lay_over(wrong), "--", "multiresolution")
    assert "learning.multiresolution.conditions.rollout.changes.hiden: there is no 'hiden'" in done.stdout
    wrong["learning"]["multiresolution"]["conditions"]["rollout"]["changes"] = {"hidden": -3}
    done = project.snakemake("-n", *project.lay_over(wrong), "--", "multiresolution")
    assert "learning.multiresolution.conditions.rollout.changes" in done.stdout and "at least 1" in done.stdout


def test_the_comparison_runs_by_default_on_what_a_laptop_can_and_in_full_on_more(project):
    default, full = (project.planned(name)["compare_arms"] for name in ("multiresolution", "multiresolution_full"))
    assert default == 8 * (4 + 1 + 1) and full > 5 * default


def test_the_comparison_leaves_its_answer_in_docs(project, settings_file):
    arguments = project.lay_over(small_comparison(settings_file))
    done = project.snakemake("--cores", "1", *arguments, "--", "multiresolution")
    assert done.returncode == 0, done.stdout
    page = (project.folder / "docs/multiresolution.md").read_text()
    assert "Coarse to fine against as many restarts at one scale" in page and "2 draws" in page
    table = pd.read_csv(project.folder / "docs/multiresolution.csv")
    assert list(table["arm"]) == ["restarted", "coarse_to_fine"] and set(table["dataset"]) == {"smooth"}
    assert (project.folder / "docs/multiresolution.png").stat().st_size > 1000
