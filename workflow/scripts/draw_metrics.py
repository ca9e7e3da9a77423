"""Draw training loss and test error against the number of scales."""

from myowave.job import job_log
from myowave.learning.evaluation import read_evaluations, read_histories
from myowave.learning.figures import draw_metrics
from myowave.plotting import save

with job_log("draw metrics", snakemake.log[0]):
    summary = read_evaluations(snakemake.input.evaluations)
    save(draw_metrics(summary, read_histories(snakemake.input.histories)), snakemake.output.figure)
