"""Bring the evaluations of all models into one table; rows that this run did not make come last."""

from myowave.learning.tables import read_evaluations
from myowave.workflow.job import job_log

with job_log("summarize models", snakemake.log[0]):
    table = read_evaluations([*snakemake.input.evaluations, *snakemake.params.beside])
    table.to_csv(snakemake.output.summary, index=False)
