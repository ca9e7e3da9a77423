"""Show the results in MLflow."""

from pathlib import Path

from myowave.job import job_log
from myowave.tracking import TrainedModel, publish

with job_log("publish runs", snakemake.log[0]) as log:
    models = [
        TrainedModel(Path(evaluation).parent, snakemake.params.recipes[Path(evaluation).parts[-3]], tuple(figures))
        for evaluation, figures in snakemake.params.models
    ]
    note = publish(models, snakemake.params.tracking["uri"])
    log.say(note)
    for path in snakemake.output:
        Path(path).write_text(note, encoding="utf-8")
