"""One worker of a sweep: try settings until the search has as many trials as asked for."""

from functools import partial
from pathlib import Path

from myowave.data.store import read_scales
from myowave.learning.from_settings import build_task
from myowave.learning.sweep.objective import judge
from myowave.learning.sweep.search import count, describe, open_search, work
from myowave.settings import Sweep
from myowave.workflow.job import job_log

params, judged, worker = snakemake.params, snakemake.params.judged, int(snakemake.wildcards.worker)
sweep = Sweep.model_validate(params.sweep)
label = f"sweep {sweep.dataset} {sweep.model} {sweep.recipe} {sweep.scales}-scale, worker {worker}"
with job_log(label, snakemake.log[0]) as log:
    search = open_search(Path(snakemake.input.search).read_text(), params.journal, seed=worker)
    task = build_task(
        read_scales(snakemake.input.scales),
        sweep.model,
        physics=judged["physics"],
        recipe=judged["recipe"],
        identify=judged["identify"],
        total=sweep.scales,
        seeds=sweep.seeds,
    )
    objective = partial(judge, task=task, epochs=sweep.epochs)
    tried = 0
    for trial in work(search, sweep, objective, worker):
        tried += 1
        log.say(describe(trial))
        log.progress(count(search), sweep.trials, describe(trial))
    Path(snakemake.output.done).write_text(f"{tried} settings tried by this worker since it was last started\n")
