"""Bring a sweep's trials into a table, a file with the best settings, and figures."""

from pathlib import Path

from myowave.learning.sweep.figures import draw_search
from myowave.learning.sweep.outcome import override_text, summary_text
from myowave.learning.sweep.search import best_settings, open_search, tabulate
from myowave.plotting import save
from myowave.settings import Sweep, parse_recipe
from myowave.workflow.job import job_log

params, output = snakemake.params, snakemake.output
sweep = Sweep.model_validate(params.sweep)
what = f"{sweep.dataset}, {sweep.model}, recipe {sweep.recipe}, {sweep.scales}-scale"
with job_log(f"summarize sweep of {what}", snakemake.log[0]) as log:
    search = open_search(Path(snakemake.input.search).read_text(), params.journal)
    recipe = parse_recipe(params.recipe)
    table, best = tabulate(search, sweep, params.recipe), best_settings(search)
    table.to_csv(output.trials, index=False)
    Path(output.best).write_text(override_text(sweep, recipe, best, table, output.best), encoding="utf-8")
    summary = summary_text(sweep, params.recipe, best, table)
    Path(output.summary).write_text(summary, encoding="utf-8")
    log.announce(f"Sweep of {what}\n{summary}")
    figures = draw_search(search)
    for path in output.figures:
        save(figures[Path(path).stem], path)
