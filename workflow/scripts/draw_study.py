"""Draw how often the diagnosis was right in each world."""

import pandas as pd

from myowave.diagnosis.study.figures import draw_study
from myowave.plotting import save
from myowave.workflow.job import job_log

with job_log("draw study", snakemake.log[0]):
    save(draw_study(pd.read_csv(snakemake.input.summary)), snakemake.output.figure)
