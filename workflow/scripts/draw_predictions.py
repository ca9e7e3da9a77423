"""Draw the predicted motion of the test trials against the measured one."""

from myowave.job import job_log
from myowave.learning.evaluation import read_evaluations, read_predictions
from myowave.learning.figures import draw_predictions
from myowave.plotting import save

with job_log("draw predictions", snakemake.log[0]):
    summary = read_evaluations(snakemake.input.evaluations)
    save(draw_predictions(read_predictions(snakemake.input.predictions), summary), snakemake.output.figure)
