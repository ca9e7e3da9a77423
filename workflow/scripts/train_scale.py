"""Train the network at one scale, starting where the next coarser scale stopped."""

import pandas as pd

from myowave.data.store import read_scales, write_table
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.from_settings import build_task
from myowave.learning.training import train_scale
from myowave.workflow.job import job_log

where, params = snakemake.wildcards, snakemake.params
level, total = int(where.level), int(where.scales)
label = f"train {where.dataset} {where.model} {where.recipe} {total}-scale, scale {-level}"
with job_log(label, snakemake.log[0]) as log:
    task = build_task(
        read_scales(snakemake.input.scales),
        where.model,
        physics=params.physics,
        recipe=params.recipe,
        identify=params.identify,
        total=total,
        seeds=params.seeds,
        wavelet=params.wavelet,
    )
    before = Checkpoint.load(snakemake.input.coarser) if snakemake.input.coarser else None
    rows = []
    for report in train_scale(task, level, before):
        log.progress(report.epoch, task.epochs(level), report.summary())
        rows += report.rows()
    report.checkpoint.save(snakemake.output.checkpoint)
    write_table(pd.DataFrame(rows), snakemake.output.history)
