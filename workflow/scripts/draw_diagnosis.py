"""Draw the diagnosis of a dataset: compare, where, which, watch."""

import json
from pathlib import Path

import pandas as pd

from myowave.data.store import read_table
from myowave.diagnosis.report.figures import draw_diagnosis
from myowave.plotting import save
from myowave.workflow.job import job_log

with job_log(f"draw diagnosis of {snakemake.wildcards.dataset}", snakemake.log[0]):
    tables = {Path(path).stem: pd.read_csv(path) for path in [*snakemake.input.tables, *snakemake.input.comparison]}
    watched = {"ladder": pd.read_csv(snakemake.input.ladder), "parameters": pd.read_csv(snakemake.input.parameters)}
    verdict = json.loads(Path(snakemake.input.verdict).read_text(encoding="utf-8"))
    figures = draw_diagnosis(tables | watched, read_table(snakemake.input.predictions)[0], verdict)
    for path in snakemake.output.figures:
        save(figures[Path(path).stem], path)
