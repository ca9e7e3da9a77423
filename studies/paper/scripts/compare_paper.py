"""Bring the paper's own recipe into tables and figures beside the printed values."""

import itertools
from pathlib import Path

from myowave.learning.tables import read_histories
from myowave.plotting import save
from myowave.scores import read_evaluations
from myowave.workflow.job import job_log
from studies.paper import figures, tables
from studies.paper.one_step import tabulate_one_step
from studies.paper.page import write_page

files, output, params = snakemake.input, snakemake.output, snakemake.params
with job_log("compare with the paper", snakemake.log[0]):
    one_step = tabulate_one_step(files.checkpoints, files.trials)
    cases, subject, chosen = (read_evaluations(f).merge(one_step) for f in (files.cases, files.subject, files.choices))
    errors, values = tables.parameter_errors(cases), tables.identified_values(subject, params.identify)
    by_case = itertools.groupby(files.histories, lambda path: Path(path).parts[-5])
    histories = {case: read_histories(paths) for case, paths in by_case}
    page = write_page(cases, subject, chosen, errors, values, params.recipes, params.best)
    Path(output.page).write_text(page, encoding="utf-8")
    save(figures.draw_scales(cases, subject), output.scales)
    save(figures.draw_errors(errors), output.errors)
    save(figures.draw_convergence(histories, params.recipes[params.best]["batches"]), output.convergence)
