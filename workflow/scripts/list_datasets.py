"""List all datasets on one page: picture, verdict, errors, what to do next."""

from pathlib import Path

from myowave.diagnosis.report.index import read_entries, read_entry, write_index
from myowave.workflow.job import job_log

inputs, params = snakemake.input, snakemake.params
with job_log("list datasets", snakemake.log[0]) as log:
    folders = [Path(verdict).parent for verdict in inputs.verdicts]
    entries = [read_entry(folder, params.settings[folder.name]) for folder in folders]
    beside = {Path("results/diagnosis", name): settings for name, settings in params.beside.items()}
    page = write_index([*entries, *read_entries(beside, log.announce)], params.links, Path(inputs.template))
    Path(snakemake.output.index).write_text(page, encoding="utf-8")
