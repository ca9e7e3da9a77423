"""Bring the evaluations of all models into one table."""

from myowave.job import job_log
from myowave.learning.tables import read_evaluations

with job_log("summarize models", snakemake.log[0]):
    read_evaluations(snakemake.input.evaluations).to_csv(snakemake.output.summary, index=False)
