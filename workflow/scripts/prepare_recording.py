"""Read the raw recordings of a session, process them into trials, and report on their quality."""

from myowave.data.preparing import prepare_recording
from myowave.data.store import write_json, write_trials
from myowave.settings import PathTable, RecordedDataset
from myowave.workflow.job import job_log

name = snakemake.wildcards.dataset
with job_log(f"prepare recording of {name}", snakemake.log[0]) as log:
    dataset = RecordedDataset.model_validate(snakemake.params.dataset)
    tables = {muscle: PathTable.model_validate(table) for muscle, table in snakemake.params.tables.items()}
    prepared, quality = prepare_recording(name, dataset, tables=tables)
    write_trials(prepared.trials, snakemake.output.trials)
    write_json(quality, snakemake.output.quality)
    log.announce(f"{name}: {quality['summary']}")
