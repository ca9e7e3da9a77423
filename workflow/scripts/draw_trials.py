"""Draw EMG and motion of all trials of a dataset, and a trial at each scale."""

from myowave.data.figures import draw_scales, draw_trials
from myowave.data.store import read_scales, read_trials
from myowave.plotting import save
from myowave.workflow.job import job_log

with job_log(f"draw trials of {snakemake.wildcards.dataset}", snakemake.log[0]):
    save(draw_trials(read_trials(snakemake.input.trials)), snakemake.output.trials)
    save(draw_scales(read_scales(snakemake.input.scales)), snakemake.output.scales)
