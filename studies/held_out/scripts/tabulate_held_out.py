"""Bring the scores of all choices of trials into one table."""

from pathlib import Path

import pandas as pd

from myowave.workflow.job import job_log
from studies.held_out.table import tabulate_scales, write_page

with job_log("tabulate held out", snakemake.log[0]):
    scores = pd.concat([pd.read_csv(path) for path in snakemake.input.scores], ignore_index=True)
    table = tabulate_scales(scores)
    table.to_csv(snakemake.output.table, index=False)
    seconds = scores.groupby(["scales", "held_out"])["seconds"].first().sum()
    first = scores.iloc[0]
    page = write_page(table, first["dataset"], first["recipe"], seconds)
    Path(snakemake.output.page).write_text(page, encoding="utf-8")
