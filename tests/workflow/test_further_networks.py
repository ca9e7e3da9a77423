"""Networks beside those of all datasets: further recipes."""


def test_a_further_recipe_is_trained_where_it_is_named(project):
    targets = {"datasets": ["case1", "case2"], "scales": [2], "follow_verdict": []}
    without = project.planned(*project.lay_over({"targets": targets}))
    further = {"own_recipes": {"case1": ["rollout", "paper_split"]}}
    planned = project.planned(*project.lay_over({"targets": targets | further}))
    assert without["train_scale"] == 2 * 2 and planned["train_scale"] == 3 * 2
    assert planned["evaluate_model"] == 3 and planned["draw_models"] == 2 + 1
    others = targets | further | {"datasets": ["case2"]}
    assert project.planned(*project.lay_over({"targets": others}))["train_scale"] == 2, "case1 is not made at all"


def test_the_main_job_trains_with_the_papers_own_method(project):
    for scales in (1, 3):
        page = f"results/learning/case1/base/paper_split/{scales}-scale/evaluation.csv"
        assert page in project.snakemake("-n").stdout


def test_a_further_recipe_that_is_not_there_is_refused(project):
    wrong = {"targets": {"own_recipes": {"case1": ["rollot"], "case9": ["rollout"]}}}
    done = project.snakemake("-n", *project.lay_over(wrong))
    assert "targets.own_recipes.case1[0]: there is no 'rollot'; did you mean 'rollout'?" in done.stdout
    assert "targets.own_recipes.case9: there is no 'case9'" in done.stdout
