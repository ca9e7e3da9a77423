"""Draw the models of a dataset against the number of scales: training and test error, predictions, parameters."""

from pathlib import Path

from myowave.learning.figures import draw_metrics, draw_parameters, draw_predictions
from myowave.learning.tables import read_histories, read_predictions
from myowave.plotting import save
from myowave.scores import read_evaluations
from myowave.workflow.job import job_log

where = snakemake.wildcards
with job_log(f"draw models of {where.dataset} {where.model} {where.recipe}", snakemake.log[0]):
    summary = read_evaluations(snakemake.input.evaluations)
    baselines = read_evaluations(snakemake.input.baselines) if snakemake.input.baselines else summary.iloc[:0]
    figures = {
        "predictions": draw_predictions(read_predictions(snakemake.input.predictions), summary),
        "metrics": draw_metrics(summary, read_histories(snakemake.input.histories), baselines),
        "parameters": draw_parameters(summary, list(snakemake.params.identify)),
    }
    for path in snakemake.output.figures:
        save(figures[Path(path).stem], path)
