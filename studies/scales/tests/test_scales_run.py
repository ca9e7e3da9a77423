"""The comparison as Snakemake runs it: a small one leaves its answer in docs/."""

import pandas as pd
import yaml
from project_copy import ROOT, Project

STUDY = ("-s", "studies/scales/Snakefile")
CONDITIONS = yaml.safe_load((ROOT / "studies/scales/settings.yaml").read_text())["scales"]["conditions"]


def small(changes: dict) -> dict:
    """The comparison on one dataset under one condition, of seconds."""
    only = {"datasets": ["smooth"], "ways": ["one", "restarted", "coarse_to_fine"], "changes": changes}
    others = {name: None for name in CONDITIONS if name != "rollout"}
    datasets = dict.fromkeys(["human_curls", "wide_band", "wide_band_1khz", "noisy_angle"])
    compared = {"draws": 2, "seeds": 2, "datasets": datasets, "conditions": others | {"rollout": only}}
    return {"data": {"datasets": {"smooth": {"samples": 100}}}, "scales": compared}


def test_it_runs_by_default_on_what_a_laptop_can_and_in_full_on_more(project: Project):
    default, full = (project.planned(*STUDY, name)["compare_ways"] for name in ("scales", "scales_full"))
    assert default == 8 * (4 + 1 + 1) and full > 5 * default


def test_it_leaves_its_answer_in_docs(project: Project):
    arguments = project.lay_over(small({"epochs": 3, "hidden": 4}))
    done = project.snakemake(*STUDY, "--cores", "1", *arguments)
    assert done.returncode == 0, done.stdout
    page = (project.folder / "docs/multiresolution.md").read_text()
    assert "Coarse to fine against as many restarts at one scale" in page and "2 draws" in page
    table = pd.read_csv(project.folder / "docs/multiresolution.csv")
    assert list(table["way"]) == ["restarted", "coarse_to_fine"] and set(table["dataset"]) == {"smooth"}
    assert (project.folder / "docs/multiresolution.png").stat().st_size > 1000
    with_more = project.lay_over(
        small({"epochs": 3, "hidden": 4}) | {"learning": {"recipes": {"recorded": {"epochs": 9}}}}
    )
    assert project.planned(*STUDY, *with_more) == {}, "nothing of it uses that recipe"
    code = project.folder / "studies/scales/judge.py"
    code.write_text(code.read_text().replace("LEVEL = 0.95", "LEVEL = 0.9"))
    assert set(project.planned(*STUDY, *arguments)) == {"judge_ways", "scales"}, (
        "an edit of the study's code reruns what uses it"
    )
