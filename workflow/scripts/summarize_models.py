"""Bring the evaluations of all models into one table."""

from myowave.learning.tables import read_evaluations
from myowave.workflow.job import job_log

with job_log("summarize models", snakemake.log[0]):
    read_evaluations(snakemake.input.evaluations).to_csv(snakemake.output.summary, index=False)
