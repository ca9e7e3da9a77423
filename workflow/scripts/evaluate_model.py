"""Score a trained model on all trials, running free, and what it identified where the truth is known."""

from myowave.data.json_files import read_json, replacing
from myowave.data.store import read_trials, write_table
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.evaluation import evaluate, predict_trials, tabulate_parameters, tabulate_predictions
from myowave.workflow.job import job_log

where = snakemake.wildcards
with job_log(f"evaluate {where.dataset} {where.model} {where.recipe} {where.scales}-scale", snakemake.log[0]):
    checkpoint = Checkpoint.load(snakemake.input.checkpoint)
    trials = read_trials(snakemake.input.trials).thinned(checkpoint.recipe["rate_hz"])
    predicted = predict_trials(checkpoint, trials)
    truth = read_json(snakemake.input.truth)["parameters"] if snakemake.input.truth else None
    rows = evaluate(checkpoint, trials, predicted, recipe=where.recipe, truth=truth)
    with replacing(snakemake.output.evaluation) as temporary:  # other runs read it too
        rows.to_csv(temporary, index=False)
    tabulate_parameters(checkpoint).to_csv(snakemake.output.parameters, index=False)
    write_table(tabulate_predictions(checkpoint, trials, predicted), snakemake.output.predictions)
