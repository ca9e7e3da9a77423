"""Networks beside those of all datasets: further recipes."""


def test_the_main_job_trains_with_the_papers_own_method_and_further_recipes_only_where_they_are_named(project):
    shipped = project.snakemake("-n").stdout
    for scales in (1, 3):
        assert f"results/learning/case1/base/paper_split/{scales}-scale/evaluation.csv" in shipped
    further = {"datasets": ["case1", "case2"], "scales": [2], "own_recipes": {"case1": ["rollout", "paper_split"]}}
    planned = project.planned(*project.lay_over({"targets": further | {"follow_verdict": []}}))
    assert planned["train_scale"] == 3 * 2 and planned["evaluate_model"] == planned["draw_models"] == 3
