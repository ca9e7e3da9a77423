# Table of contents of the workflow. What is computed stands in config.yaml, how in workflow/rules/, in reading order.
from pathlib import Path

from snakemake.exceptions import WorkflowError

from myowave.workflow.job import check_writable

ROOT = Path(workflow.current_basedir.get_path_or_uri(secret_free=True))  # of myowave, also within another workflow


configfile: ROOT / "config.yaml"  # lay your own over it: --configfile config.yaml mine.yaml


include: "workflow/rules/common.smk"
include: "workflow/rules/targets.smk"
include: "workflow/rules/data.smk"
include: "workflow/rules/learning.smk"
include: "workflow/rules/diagnosis.smk"
include: "workflow/rules/tracking.smk"
include: "workflow/rules/reality.smk"


if SETTINGS.learning.sweep:

    include: "workflow/rules/sweep.smk"


localrules:
    all,


rule all:
    default_target: True
    input:
        SUMMARIES,
        "results/tracking/published.md",
        FIGURES_OF_DATA,
        FIGURES_OF_LEARNING,
        VERDICTS,
        "results/index.html",


onstart:
    try:
        check_writable("results")
    except ValueError as error:
        raise WorkflowError(str(error)) from None


onsuccess:
    if Path("results/index.html").exists():
        print(f"All results on one page: {Path('results/index.html').resolve()}")
