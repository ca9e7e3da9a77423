"""Read the recordings of a dataset, process them into trials, and report on their quality."""

from myowave.data.importing import import_trials
from myowave.data.json_files import write_json
from myowave.data.store import write_trials
from myowave.settings import PathTable
from myowave.settings.data import real_dataset
from myowave.workflow.job import job_log

name = snakemake.wildcards.dataset
with job_log(f"import trials of {name}", snakemake.log[0]) as log:
    tables = {muscle: PathTable.model_validate(table) for muscle, table in snakemake.params.tables.items()}
    dataset = real_dataset(snakemake.params.dataset)
    prepared, quality = import_trials(name, dataset, tables=tables, channels=snakemake.params.channels)
    write_trials(prepared.trials, snakemake.output.trials)
    write_json(quality, snakemake.output.quality)
    log.announce(f"{name}: {quality['summary']}")
