"""Check the recordings of a dataset and bring them into the form of all trials."""

from myowave.data.importing import check_tables, import_trials
from myowave.data.store import write_trials
from myowave.settings import MeasuredDataset, PathTable
from myowave.workflow.job import job_log

name = snakemake.wildcards.dataset
with job_log(f"import trials of {name}", snakemake.log[0]) as log:
    dataset = MeasuredDataset.model_validate(snakemake.params.dataset)
    trials = import_trials(name, dataset, channels=snakemake.params.channels)
    for line in check_tables(trials, {m: PathTable.model_validate(t) for m, t in snakemake.params.tables.items()}):
        log.say(line)
    write_trials(trials, snakemake.output.trials)
