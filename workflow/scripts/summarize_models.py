"""Bring the evaluations of all models into one table; rows that this run did not make come last."""

import pandas as pd

from myowave.scores import read_evaluation
from myowave.workflow.job import job_log

with job_log("summarize models", snakemake.log[0]):
    tables = [read_evaluation(path, snakemake.params.seeds) for path in snakemake.input.evaluations]
    tables += [read_evaluation(path) for path in snakemake.params.beside]
    pd.concat(tables, ignore_index=True).to_csv(snakemake.output.summary, index=False)
