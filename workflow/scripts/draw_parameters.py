"""Draw the identified parameters against the number of scales."""

from myowave.job import job_log
from myowave.learning.evaluation import read_evaluations
from myowave.learning.figures import draw_parameters
from myowave.plotting import save

with job_log("draw parameters", snakemake.log[0]):
    summary = read_evaluations(snakemake.input.evaluations)
    save(draw_parameters(summary, list(snakemake.params.identify)), snakemake.output.figure)
