"""Draw EMG and motion of all trials of a dataset, and a trial at each scale."""

from myowave.data.figures import draw_scales, draw_trials
from myowave.data.store import read_trials
from myowave.data.wavelets import decompose
from myowave.plotting import save
from myowave.workflow.job import job_log

with job_log(f"draw trials of {snakemake.wildcards.dataset}", snakemake.log[0]):
    trials = read_trials(snakemake.input.trials)
    save(draw_trials(trials), snakemake.output.trials)
    save(draw_scales(decompose(trials, snakemake.params.levels)), snakemake.output.scales)
