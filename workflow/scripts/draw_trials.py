"""Draw EMG and motion of all trials of a dataset."""

from myowave.data.figures import draw_trials
from myowave.data.store import read_trials
from myowave.job import job_log
from myowave.plotting import save

with job_log(f"draw trials of {snakemake.wildcards.dataset}", snakemake.log[0]):
    save(draw_trials(read_trials(snakemake.input.trials)), snakemake.output.figure)
