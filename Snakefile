# Table of contents of the workflow. What is computed stands in config.yaml, how in workflow/rules/, in reading order.
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.logging import logger
from snakemake.settings.enums import Quietness

from myowave.workflow.job import check_writable
from myowave.workflow.time_left import Job, TimeLeft

ROOT = Path(workflow.current_basedir.get_path_or_uri(secret_free=True))  # of myowave, also within another workflow


configfile: ROOT / "config.yaml"  # lay your own over it: --configfile config.yaml mine.yaml


include: "workflow/rules/common.smk"
include: "workflow/rules/targets.smk"
include: "workflow/rules/data.smk"
include: "workflow/rules/learning.smk"
include: "workflow/rules/sweep.smk"
include: "workflow/rules/held_out.smk"
include: "workflow/rules/diagnosis.smk"
include: "workflow/rules/study.smk"
include: "workflow/rules/tracking.smk"
include: "workflow/rules/subjects.smk"
include: "workflow/rules/paper.smk"
include: "workflow/rules/multiresolution.smk"
include: "workflow/rules/teaching.smk"


localrules:
    all,


rule all:
    default_target: True
    input:
        summaries,
        "results/tracking/published.md",
        figures_of_data,
        figures_of_learning,
        verdicts,
        "results/index.html",


def jobs_left():
    """Jobs of this run that have not ended, by number; checkpoints may add some."""
    return {job.jobid: Job(job.rule.name, job.threads) for job in workflow.dag.needrun_jobs()}


def say_time_left(text):
    logger.info(text, extra={"quietness": Quietness.PROGRESS})


onstart:
    try:
        check_writable("results")
    except ValueError as error:
        raise WorkflowError(str(error)) from None
    if workflow.local_exec:  # nobody knows how many jobs a cluster runs at a time
        logger.addHandler(TimeLeft(jobs_left, workflow.cores, say_time_left))


onsuccess:
    if Path("results/index.html").exists():
        print(f"All results on one page: {Path('results/index.html').resolve()}")
