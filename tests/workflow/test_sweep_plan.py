"""What of a sweep is made again: more trials go on with the search, and training is not touched by the search."""

import copy

import pytest
import test_slurm
from project_copy import Project, copy_project

SMALL = {"learning": {"sweep": {"dataset": "case1", "trials": 4, "workers": 2}}}
SEARCHED = {"search_settings": 3, "summarize_sweep": 1, "score_sweep": 1}


@pytest.fixture(scope="module")
def swept(tmp_path_factory) -> Project:
    """A project whose sweep is finished and recorded as done."""
    project = copy_project(tmp_path_factory.mktemp("swept"))
    project.finish(*project.lay_over(SMALL), "--", "sweep")
    return project


def planned_after(project: Project, **changes) -> dict[str, int]:
    config = copy.deepcopy(SMALL)
    config["learning"]["sweep"] |= changes
    jobs = project.planned(*project.lay_over(config), "--", "sweep")
    jobs.pop("sweep", None)
    return jobs


def test_more_trials_and_another_worker_go_on_with_the_same_search(swept):
    assert planned_after(swept, trials=8, workers=3) == SEARCHED


def test_fewer_workers_look_for_what_the_others_were_killed_in(swept):
    assert planned_after(swept, workers=1) == SEARCHED | {"search_settings": 1}


def test_what_a_trial_is_judged_by_makes_a_new_search(swept):
    assert planned_after(swept, seeds=3)["prepare_sweep"] == 1


def test_code_that_makes_the_model_of_a_trial_makes_a_new_search(swept):
    file = swept.folder / "src/myowave/models.py"
    original = file.read_text()
    file.write_text(original + "\nCHANGED = 1\n")
    planned = planned_after(swept)
    file.write_text(original)
    assert planned["prepare_sweep"] == 1


def test_what_the_tests_with_programs_of_debian_ask_for_is_made_by_rules(tmp_path):
    """They do not run every day."""
    project = copy_project(tmp_path)
    jobs = project.planned(*project.lay_over(test_slurm.SMALL), "--", *test_slurm.TARGETS)
    assert jobs["search_settings"] == 2 and "import_trials" not in jobs
