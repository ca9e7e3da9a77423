"""Put the fitted models of a dataset and the networks trained with them side by side."""

import pandas as pd

from myowave.data.json_files import read_json
from myowave.diagnosis.report.ladder import join_ladder, join_parameters
from myowave.scores import read_evaluation
from myowave.workflow.job import job_log

with job_log(f"watch {snakemake.wildcards.dataset}", snakemake.log[0]):
    seeds = snakemake.params.seeds
    evaluations = [read_evaluation(path, seeds) for path in snakemake.input.evaluations]
    evaluations += [read_evaluation(path) for path in snakemake.params.beside]
    verdict = read_json(snakemake.input.verdict)
    plain = [read_evaluation(path, seeds) for path in snakemake.input.baselines]
    ladder = join_ladder(pd.read_csv(snakemake.input.rungs), evaluations, plain)
    ladder.to_csv(snakemake.output.ladder, index=False)
    join_parameters(verdict, evaluations).to_csv(snakemake.output.parameters, index=False)
