"""Judge for every dataset, model and recipe whether more scales help."""

from myowave.learning.tables import judge_scales
from myowave.scores import read_evaluation
from myowave.workflow.job import job_log

with job_log("judge scales", snakemake.log[0]) as log:
    judged = judge_scales(read_evaluation(snakemake.input.summary))
    judged.to_csv(snakemake.output.scales, index=False)
    log.announce(f"more scales: {', '.join(f'{row.dataset} {row.finding}' for row in judged.itertuples()) or 'none'}")
