"""Bring the training trials to all scales, and make the search that workers will share."""

from pathlib import Path

from myowave.data.store import read_trials, write_scales
from myowave.data.wavelets import decompose
from myowave.learning.sweep.outcome import search_name
from myowave.learning.sweep.search import open_search, try_first
from myowave.settings import Sweep, Wavelet
from myowave.workflow.job import job_log

params, output = snakemake.params, snakemake.output
with job_log("prepare sweep", snakemake.log[0]) as log:
    sweep, wavelet = Sweep.model_validate(params.sweep), Wavelet.model_validate(params.wavelet)
    trials = read_trials(snakemake.input.trials)
    trials = trials.select(trials.train).thinned(params.judged["recipe"]["rate_hz"])
    write_scales(decompose(trials, sweep.scales - 1, wavelet.name), output.scales)
    name = search_name(sweep, params.judged, Path(output.scales))
    try_first(open_search(name, params.journal), params.judged["recipe"], sweep)
    Path(output.search).write_text(name)
    log.say(f"search {name!r} in {params.journal}")
