"""All scores as one table, and what they say as a picture."""

import pandas as pd

from myowave.plotting import save
from myowave.workflow.job import job_log
from studies.held_out.page import draw_differences

with job_log("held out", snakemake.log[0]):
    scores = pd.concat(map(pd.read_csv, snakemake.input.scores))
    for path in (snakemake.output.table, snakemake.output.kept):
        scores.to_csv(path, index=False, float_format="%.5g")
    save(draw_differences(scores), snakemake.output.picture)
