"""Show the results in MLflow."""

from pathlib import Path

from myowave.tracking.contents import read_results
from myowave.tracking.store import publish
from myowave.workflow.job import job_log

with job_log("publish runs", snakemake.log[0]) as log:
    datasets = read_results(Path("results"), snakemake.params.recipes)
    note = publish(datasets, snakemake.params.tracking["uri"], needed=not snakemake.output)
    log.announce(note.rstrip())
    for path in snakemake.output:
        Path(path).write_text(note, encoding="utf-8")
