"""Bring a sweep's trials into a table, a file with the best settings, and figures."""

import json
from pathlib import Path

from myowave.learning.sweep import figures
from myowave.learning.sweep.outcome import override_text, summary_text
from myowave.learning.sweep.search import best_settings, importances, open_search, tabulate
from myowave.plotting import save
from myowave.settings import PlannedSweep, Recipe
from myowave.workflow.job import job_log

params, output = snakemake.params, snakemake.output
sweep = PlannedSweep.model_validate(params.sweep)
what = f"{sweep.dataset}, {sweep.model}, recipe {sweep.recipe}, {sweep.scales}-scale"
with job_log(f"summarize sweep of {what}", snakemake.log[0]) as log:
    shared = json.loads(Path(snakemake.input.search).read_text())
    search = open_search(shared["name"], params.storage, sweep, params.recipe)
    recipe = Recipe.model_validate(params.recipe)
    table, best, shares = tabulate(search), best_settings(search), importances(search)
    table.to_csv(output.trials, index=False)
    Path(output.best).write_text(override_text(sweep, recipe, best, table, output.best), encoding="utf-8")
    summary = summary_text(sweep, search.default, best, table)
    Path(output.summary).write_text(summary, encoding="utf-8")
    log.announce(f"Sweep of {what}\n{summary}")
    save(figures.draw_history(table, what), output.history)
    save(figures.draw_importance(shares, what), output.importance)
    save(figures.draw_slices(table, sweep.dimensions, what), output.slices)
    save(figures.draw_contours(table, sweep.dimensions, shares, what), output.contours)
