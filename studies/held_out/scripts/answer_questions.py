"""Bring the scores of all splits into one table, a page and a picture."""

from datetime import date
from pathlib import Path

import pandas as pd

from myowave.plotting import save
from myowave.workflow.job import job_log
from studies.held_out.answers import COLUMNS, differences, write_page
from studies.held_out.figures import draw_answers

with job_log("answer questions", snakemake.log[0]):
    scores = pd.concat([pd.read_csv(path) for path in snakemake.input.scores], ignore_index=True)
    scores[COLUMNS].to_csv(snakemake.output.table, index=False)
    found = differences(scores, snakemake.params.recipe)
    page = write_page(scores, found, snakemake.params.recipe, date.today())
    Path(snakemake.output.page).write_text(page, encoding="utf-8")
    save(draw_answers(scores, snakemake.params.recipe), snakemake.output.picture)
