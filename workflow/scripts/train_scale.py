"""Train the network at one scale, starting where the next coarser scale stopped."""

import pandas as pd

from myowave.data.store import read_scales, write_table
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.training import count_epochs, train_scale
from myowave.physics.build import build_model
from myowave.settings import Identify, Physics, Recipe
from myowave.workflow.job import follow, job_log

where, params = snakemake.wildcards, snakemake.params
level, total = int(where.level), int(where.scales)
label = f"train {where.dataset} {where.model} {where.recipe} {total}-scale, scale {-level}"
with job_log(label, snakemake.log[0]) as log:
    recipe = Recipe.model_validate(params.recipe)
    reports = train_scale(
        read_scales(snakemake.input.scales),
        build_model(where.model, Physics.model_validate(params.physics)),
        recipe,
        {name: Identify.model_validate(values) for name, values in params.identify.items()},
        level=level,
        total=total,
        seeds=range(params.seeds),
        start=Checkpoint.load(snakemake.input.coarser) if snakemake.input.coarser else None,
    )
    rows = []
    for report in follow(reports, count_epochs(recipe, level, total), log):
        rows += report.rows()
    report.checkpoint.save(snakemake.output.checkpoint)
    write_table(pd.DataFrame(rows), snakemake.output.history)
