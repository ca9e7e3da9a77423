"""Train the network at one scale, starting where the next coarser scale stopped."""

import pandas as pd

from myowave.data.store import read_scales, write_table
from myowave.data.wavelets import thin_scales
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.task import Task
from myowave.learning.training import train_scale
from myowave.models import build_model
from myowave.settings import Identify, Physics, Wavelet, parse_recipe
from myowave.workflow.job import job_log

where, params = snakemake.wildcards, snakemake.params
level, total = int(where.level), int(where.scales)
label = f"train {where.dataset} {where.model} {where.recipe} {total}-scale, scale {-level}"
with job_log(label, snakemake.log[0]) as log:
    recipe, wavelet = parse_recipe(params.recipe), Wavelet.model_validate(params.wavelet)
    scales = read_scales(snakemake.input.scales)
    task = Task(
        thin_scales(scales, recipe.rate_hz, total - 1, wavelet.name),
        build_model(where.model, Physics.model_validate(params.physics)),
        recipe,
        {name: Identify.model_validate(values) for name, values in params.identify.items()},
        total=total,
        seeds=range(params.seeds),
    )
    before = Checkpoint.load(snakemake.input.coarser) if snakemake.input.coarser else None
    rows = []
    for report in train_scale(task, level, before):
        log.progress(report.epoch, task.epochs(level), report.summary())
        rows += report.rows()
    report.checkpoint.save(snakemake.output.checkpoint)
    write_table(pd.DataFrame(rows), snakemake.output.history)
