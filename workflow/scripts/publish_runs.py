"""Show the results in MLflow."""

from pathlib import Path

from myowave.tracking.contents import Swept, TrainedModel, from_diagnosis, from_model, from_sweep
from myowave.tracking.store import publish
from myowave.workflow.job import job_log

with job_log("publish runs", snakemake.log[0]) as log:
    groups = [
        from_model(TrainedModel(Path(evaluation).parent, snakemake.params.recipes[Path(evaluation).parts[-3]], figures))
        for evaluation, figures in snakemake.params.models
    ]
    groups += [from_sweep(Swept(Path(folder), figures)) for folder, figures in snakemake.params.sweeps]
    groups += [from_diagnosis(*map(Path, paths)) for paths in snakemake.params.diagnoses]
    note = publish(groups, snakemake.params.tracking["uri"], needed=not snakemake.output)
    log.announce(note.rstrip())
    for path in snakemake.output:
        Path(path).write_text(note, encoding="utf-8")
