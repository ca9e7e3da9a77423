"""Bring the paper's own recipe into tables and figures beside the printed values."""

from pathlib import Path

import pandas as pd

from myowave.job import job_log
from myowave.learning.paper import figures, tables
from myowave.learning.tables import read_evaluations
from myowave.plotting import save

output = snakemake.output
with job_log("compare with the paper", snakemake.log[0]):
    cases, subject = read_evaluations(snakemake.input.cases), read_evaluations(snakemake.input.subject)
    derivatives = read_evaluations(snakemake.input.derivatives)
    Path(output.page).write_text(tables.write_page(cases, derivatives, subject), encoding="utf-8")
    tables.parameter_errors(pd.concat([cases, derivatives]).drop_duplicates()).to_csv(output.table3, index=False)
    tables.scores_by_scales(subject).to_csv(output.table4, index=False)
    tables.identified_values(subject).to_csv(output.table5, index=False)
    save(figures.draw_scales(cases, subject), output.scales)
    save(figures.draw_errors(cases), output.errors)
    save(figures.draw_derivatives(derivatives), output.derivatives)
