"""Train with the best settings as a normal run does, and score them on the test trial beside the default."""

from pathlib import Path

import pandas as pd

from myowave.data.json_files import read_json
from myowave.data.store import read_scales, read_trials
from myowave.learning.evaluation import evaluate, predict_trials
from myowave.learning.from_settings import build_task
from myowave.learning.sweep.outcome import BEST
from myowave.learning.training import train_scales
from myowave.settings import Sweep
from myowave.settings.files import read_yaml
from myowave.workflow.job import job_log

inputs, params, judged = snakemake.input, snakemake.params, snakemake.params.judged
sweep = Sweep.model_validate(params.sweep)
name = sweep.recipe + BEST
label = f"score {sweep.dataset} {sweep.model} {name} {sweep.scales}-scale"
with job_log(label, snakemake.log[0]) as log:
    best = read_yaml(Path(inputs.best))["learning"]["recipes"][name]
    task = build_task(
        read_scales(inputs.scales),
        sweep.model,
        physics=judged["physics"],
        recipe=best,
        identify=judged["identify"],
        total=sweep.scales,
        seeds=params.seeds,
        wavelet=params.wavelet,
    )
    for checkpoint in train_scales(task):
        log.progress(sweep.scales - checkpoint.level, sweep.scales, f"scale {-checkpoint.level} is trained")
    trials = read_trials(inputs.trials).thinned(task.recipe.rate_hz)
    truth = read_json(inputs.truth)["parameters"] if inputs.truth else None
    rows = evaluate(checkpoint, trials, predict_trials(checkpoint, trials), recipe=name, truth=truth)
    both = pd.concat({"default": pd.read_csv(inputs.default), "best": rows}, names=["setting", None])
    both.reset_index(level="setting").to_csv(snakemake.output.scores, index=False)
