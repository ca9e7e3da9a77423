"""Score the networks of the paper's protocols one step ahead."""

from myowave.workflow.job import job_log
from studies.paper.one_step import tabulate_one_step

with job_log("score the paper's networks one step ahead", snakemake.log[0]):
    table = tabulate_one_step(snakemake.input.checkpoints, snakemake.input.trials)
    table.to_csv(snakemake.output.scores, index=False)
