"""List all datasets on one page: picture, verdict, errors, what to do next."""

from pathlib import Path

from myowave.diagnosis.report.index import write_index
from myowave.workflow.job import job_log

params = snakemake.params
with job_log("list datasets", snakemake.log[0]) as log:
    known = params.settings | params.beside
    folders = {Path("results/diagnosis", name): settings for name, settings in known.items()}
    page = write_index(folders, params.links, log.announce)
    Path(snakemake.output.index).write_text(page, encoding="utf-8")
