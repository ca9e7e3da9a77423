"""Plain `snakemake` knows no study; each study plans its own jobs, and refuses wrong settings."""

import re

import pytest
from project_copy import ROOT, Project

from myowave.settings import parse_settings
from myowave.settings.files import read_layers
from studies.held_out.settings import HeldOut
from studies.shared import read_section

STUDIES = sorted(path.parent.name for path in (ROOT / "studies").glob("*/Snakefile"))
OWN_RULES = {
    rule
    for name in STUDIES
    for rule in re.findall(r"^rule (\w+):", (ROOT / f"studies/{name}/Snakefile").read_text(), re.MULTILINE)
}
SECTIONS = {"held_out": HeldOut}


def test_plain_snakemake_does_not_know_the_studies():
    known = set(Project(ROOT).snakemake("--list-rules").stdout.split())
    assert {"all", "train_scale", "diagnose_dataset"} <= known
    assert OWN_RULES and OWN_RULES & known == {"reality"}  # which calls the study, as its results stand in README


@pytest.mark.parametrize("name", STUDIES)
def test_a_study_plans_its_own_jobs_and_none_of_the_main_jobs_pages(name, project):
    planned = project.planned("-s", f"studies/{name}/Snakefile")
    assert name in planned and set(planned) & OWN_RULES
    assert not set(planned) & {"diagnose_dataset", "tell_verdict", "publish_runs"}


@pytest.mark.parametrize(
    ("name", "settings", "says"),
    [
        ("held_out", {"dataset": "case7"}, "held_out.dataset: there is no 'case7'"),
        ("held_out", {"recipe": "recordd"}, "held_out.recipe: there is no 'recordd'; did you mean 'recorded'?"),
        ("held_out", {"question": {}}, "held_out.question: unknown key; did you mean 'questions'?"),
    ],
)
def test_wrong_settings_of_a_study_are_refused(name, settings, says):
    config = read_layers([ROOT / "config.yaml", ROOT / f"studies/{name}/settings.yaml"])
    own = config.pop(name)
    with pytest.raises(ValueError, match=re.escape(says)):
        read_section(SECTIONS[name], name, own | settings, parse_settings(config))
