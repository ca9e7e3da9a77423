"""Check the recordings of a dataset and bring them into the form of all trials."""

from myowave.data.importing import import_trials
from myowave.data.store import write_trials
from myowave.settings import MeasuredDataset
from myowave.workflow.job import job_log

name = snakemake.wildcards.dataset
with job_log(f"import trials of {name}", snakemake.log[0]):
    dataset = MeasuredDataset.model_validate(snakemake.params.dataset)
    trials = import_trials(name, dataset, channels=snakemake.params.channels)
    write_trials(trials, snakemake.output.trials)
