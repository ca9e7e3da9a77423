"""Draw the diagnosis of a dataset: compare, where, which, watch."""

from pathlib import Path

import pandas as pd

from myowave.data.json_files import read_json
from myowave.diagnosis.report.cells import read_ranking
from myowave.diagnosis.report.figures import draw_diagnosis
from myowave.diagnosis.report.motion import read_beside
from myowave.plotting import save
from myowave.workflow.job import job_log

inputs = snakemake.input
with job_log(f"draw diagnosis of {snakemake.wildcards.dataset}", snakemake.log[0]):
    tables = {Path(path).stem: pd.read_csv(path) for path in [*inputs.tables, *inputs.comparison]}
    networks = Path("results/learning", snakemake.wildcards.dataset)
    verdict, ladder = read_json(inputs.verdict), pd.read_csv(inputs.ladder)
    predictions = read_beside(inputs.predictions, ladder, verdict["model"], networks)
    tables |= {"ladder": ladder, "ranking": read_ranking(inputs.ranking)}
    figures = draw_diagnosis(tables, predictions, verdict)
    for path in snakemake.output.figures:
        save(figures[Path(path).stem], path)
