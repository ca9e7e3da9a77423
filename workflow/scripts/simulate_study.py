"""Simulate the trials that the study hides effects in: one dataset per seed, without effect or noise of the angle."""

from myowave.data.store import write_trials
from myowave.diagnosis.study.cases import clean_trials
from myowave.physics.build import build_model
from myowave.settings import Physics, SimulatedDataset
from myowave.workflow.job import job_log

with job_log("simulate study", snakemake.log[0]) as log:
    base = build_model("base", Physics.model_validate(snakemake.params.physics))
    dataset = SimulatedDataset.model_validate(snakemake.params.dataset)
    paths = snakemake.output.trials
    for seed, path in enumerate(paths, start=1):
        write_trials(clean_trials(dataset, base, seed), path)
        log.progress(seed, len(paths))
