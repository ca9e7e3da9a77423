"""Bring the paper's own recipe into tables and figures beside the printed values."""

from pathlib import Path

import pandas as pd

from myowave.learning.tables import join_histories, read_evaluations
from myowave.plotting import save
from myowave.workflow.job import job_log
from studies.paper import figures, tables
from studies.paper.page import write_page

output, recipes = snakemake.output, snakemake.params.recipes
with job_log("compare with the paper", snakemake.log[0]):
    cases, subject = read_evaluations(snakemake.input.cases), read_evaluations(snakemake.input.subject)
    chosen, one_step = read_evaluations(snakemake.input.choices), pd.read_csv(snakemake.input.one_step)
    histories = {Path(path).parts[-3]: join_histories(Path(path).parent, 1) for path in snakemake.input.histories}
    errors, scores = tables.parameter_errors(cases), tables.scores_by_scales(subject)
    choices = tables.compare_choices(chosen, one_step, histories, recipes)
    values = tables.identified_values(subject, snakemake.params.identify)
    best, bias = snakemake.params.best, pd.read_csv(snakemake.input.bias)
    convergence = tables.histories_by_dataset(snakemake.input.convergence)
    page = write_page(cases, subject, one_step, errors, choices, values, scores, bias, best)
    Path(output.page).write_text(page, encoding="utf-8")
    for table, path in ((errors, "table3"), (scores, "table4"), (values, "table5"), (choices, "choices")):
        table.to_csv(output[path], index=False)
    save(figures.draw_scales(cases, subject), output.scales)
    save(figures.draw_errors(errors), output.errors)
    save(figures.draw_convergence(convergence, recipes[best]["batches"]), output.convergence)
    save(figures.draw_derivatives(histories, tables.true_values(chosen), recipes), output.derivatives)
