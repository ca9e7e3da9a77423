"""Many subjects from a table: as many jobs as there are subjects, none larger."""

import pandas as pd

SUBJECTS, MODELS = 6, ["base", "base+joint_damping", "base+gravity_tilt"]


def test_every_subject_and_model_gets_its_own_jobs(project):
    recorded = {"files": "data/bench_elbow/*.csv", "test": "trial3", "mass": 1.0}
    table = pd.DataFrame([{"subject": f"s{i}", **recorded} for i in range(SUBJECTS)])
    table.to_csv(project.folder / "subjects.csv", index=False)
    config = project.lay_over(
        {
            "data": {"subjects": "subjects.csv"},
            "targets": {"datasets": ["subjects"], "models": {"subjects": MODELS}, "scales": [1], "follow_verdict": []},
        }
    )
    jobs = project.planned(*config)
    assert jobs["import_trials"] == jobs["decompose_scales"] == jobs["diagnose_dataset"] == SUBJECTS
    assert jobs["train_scale"] == jobs["evaluate_model"] == SUBJECTS * len(MODELS)
