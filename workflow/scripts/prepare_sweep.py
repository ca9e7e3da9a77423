"""Bring the training trials, whole or cut in two, to all scales, and make the search that workers will share."""

import json
import uuid
from pathlib import Path

from myowave.data.holdout import hold_out_ends
from myowave.data.store import read_trials, write_scales
from myowave.data.thinning import thin
from myowave.data.wavelets import decompose
from myowave.learning.sweep.outcome import search_name
from myowave.learning.sweep.search import open_search
from myowave.settings import PlannedSweep, Wavelet
from myowave.workflow.job import job_log

params, output = snakemake.params, snakemake.output
with job_log("prepare sweep", snakemake.log[0]) as log:
    sweep, wavelet = PlannedSweep.model_validate(params.sweep), Wavelet.model_validate(params.wavelet)
    trials = read_trials(snakemake.input.trials)
    trials = hold_out_ends(trials, sweep.held_out) if sweep.judged_on == "ends" else trials.select(trials.train)
    trials = thin(trials, params.judged["recipe"]["rate_hz"])
    write_scales(decompose(trials, sweep.scales - 1, wavelet.name, wavelet.decompose), output.scales)
    name = search_name(sweep, params.judged, Path(output.scales))
    open_search(name, params.storage, sweep, params.judged["recipe"])
    Path(output.search).write_text(json.dumps({"name": name, "owner": uuid.uuid4().hex}))
    log.say(f"search {name!r} in {params.storage}")
