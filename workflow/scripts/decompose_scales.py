"""Project the trials of a dataset on coarser scales."""

from myowave.data.store import read_trials, write_scales
from myowave.data.wavelets import decompose
from myowave.settings import Wavelet
from myowave.workflow.job import job_log

with job_log(f"decompose {snakemake.wildcards.dataset}", snakemake.log[0]):
    wavelet = Wavelet.model_validate(snakemake.params.wavelet)
    trials = read_trials(snakemake.input.trials)
    write_scales(decompose(trials, wavelet.levels, wavelet.name), snakemake.output.scales)
