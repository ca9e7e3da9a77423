"""Train networks and baselines on some trials, and score them on others."""

import pandas as pd

from myowave.data.store import read_trials
from myowave.models import build_model
from myowave.settings import Baseline, Identify, Physics, Wavelet, parse_recipe
from myowave.workflow.job import job_log
from studies.held_out.score import score_baselines, score_networks, split_trials

params = snakemake.params
with job_log(f"held out {params.question}, {params.name}", snakemake.log[0]) as log:
    trials = split_trials(read_trials(snakemake.input.trials), **params.split)
    model, recipe = build_model("base", Physics.model_validate(params.physics)), parse_recipe(params.recipe)
    wavelet = Wavelet.model_validate(params.wavelet).name
    wanted = {name: Identify.model_validate(values) for name, values in params.identify.items()}
    baselines = {name: Baseline.model_validate(values) for name, values in params.baselines.items()}
    tables = list(score_baselines(baselines, trials, model, params.seeds))
    for done, total in enumerate(params.scales, 1):
        tables += score_networks(trials, model, recipe, wanted, wavelet, total, params.seeds)
        log.progress(done, len(params.scales), f"{total} scales")
    scores = pd.concat(tables, ignore_index=True).fillna({"method": params.recipe_name})
    scores = scores.assign(question=params.question, split=params.name)
    columns = ["question", "split", "method", "scales", "seed", "test_r2", "test_rmse_deg", "trial", "inputs"]
    scores[columns].to_csv(snakemake.output.scores, index=False)
