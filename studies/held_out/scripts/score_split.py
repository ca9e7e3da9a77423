"""Train networks and baselines on some trials, and score them on others, each by itself, running free."""

import pandas as pd

from myowave.data.store import read_trials
from myowave.models import build_model
from myowave.settings import Baseline, Identify, Physics, Wavelet, parse_recipe
from myowave.workflow.job import job_log
from studies.held_out.score import score_baselines, score_networks, split_trials

params = snakemake.params
label = f"held out {params.question}, {params.name}"
with job_log(label, snakemake.log[0]) as log:
    trials = split_trials(read_trials(snakemake.input.trials), **params.split)
    model, wavelet = build_model("base", Physics.model_validate(params.physics)), Wavelet.model_validate(params.wavelet)
    wanted = {name: Identify.model_validate(values) for name, values in params.identify.items()}
    baselines = {name: Baseline.model_validate(values) for name, values in params.baselines.items()}
    seeds, tables = range(params.seeds), []
    for done, (inputs, changes) in enumerate(params.inputs.items(), 1):
        recipe = parse_recipe(params.recipe).changed(changes)
        tables.append(score_baselines(baselines, changes, trials, model, seeds).assign(inputs=inputs))
        for total in params.scales:
            scores = score_networks(trials, model, recipe, wanted, wavelet.name, total, seeds)
            tables.append(scores.assign(method=params.recipe_name, inputs=inputs))
        log.progress(done, len(params.inputs), inputs)
    scores = pd.concat(tables, ignore_index=True)
    scores.insert(0, "question", params.question)
    scores.insert(1, "split", params.name)
    scores.to_csv(snakemake.output.scores, index=False)
