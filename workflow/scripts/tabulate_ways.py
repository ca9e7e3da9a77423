"""Bring the scores of all ways in which physics teaches into one table."""

from pathlib import Path

import pandas as pd

from myowave.learning.teaching import tabulate_ways, write_page
from myowave.workflow.job import job_log

with job_log("tabulate what physics teaches", snakemake.log[0]):
    table = tabulate_ways(pd.concat([pd.read_csv(path) for path in snakemake.input.scores], ignore_index=True))
    table.to_csv(snakemake.output.table, index=False)
    Path(snakemake.output.page).write_text(write_page(table, snakemake.params.study), encoding="utf-8")
