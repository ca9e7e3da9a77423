"""Train all ways on the trials of one draw, and score them on the trials that no training saw."""

import pandas as pd
from pydantic import TypeAdapter

from myowave.models import build_model
from myowave.settings import Dataset, Physics, parse_recipe
from myowave.workflow.job import job_log
from studies.scales.compete import compete
from studies.scales.draws import draw_trials
from studies.scales.ways import WAYS

where, params = snakemake.wildcards, snakemake.params
with job_log(f"compare ways {where.condition} {where.dataset} {where.draw}", snakemake.log[0]) as log:
    physics, dataset = Physics.model_validate(params.physics), TypeAdapter(Dataset).validate_python(params.dataset)
    base, draw, names = build_model("base", physics), int(where.draw), params.ways or list(WAYS)
    trials = draw_trials(where.dataset, dataset, base, physics, snakemake.input.trials, draw, params.rate_hz)
    recipe, seeds = parse_recipe(params.recipe), range(params.seeds)
    rows = []
    for scores in compete(trials, base, recipe, scales=params.scales, seeds=seeds, names=names):
        rows.append(scores)
        log.progress(len(rows), len(names), f"{scores['way'][0]} in {scores['seconds'][0]:.0f} s")
    table = pd.concat(rows).assign(condition=where.condition, dataset=where.dataset, draw=draw)
    table.to_csv(snakemake.output.scores, index=False)
