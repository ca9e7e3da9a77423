"""Take the training trials apart from the others, and make the search that workers will share."""

from pathlib import Path

from myowave.data.store import read_trials, write_trials
from myowave.learning.sweep.outcome import search_name
from myowave.learning.sweep.search import open_search, try_first
from myowave.settings import Sweep
from myowave.workflow.job import job_log

params, output = snakemake.params, snakemake.output
with job_log("prepare sweep", snakemake.log[0]) as log:
    sweep = Sweep.model_validate(params.sweep)
    trials = read_trials(snakemake.input.trials)
    write_trials(trials.select(trials.train).thinned(params.judged["recipe"]["rate_hz"]), output.trials)
    name = search_name(sweep, params.judged, Path(output.trials))
    try_first(open_search(name, params.journal), params.judged["recipe"], sweep)
    Path(output.search).write_text(name)
    log.say(f"search {name!r} in {params.journal}")
