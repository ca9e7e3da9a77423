"""Hide an effect in simulated trials, in all strengths, seeds and noises, and diagnose each."""

from myowave.data.store import read_trials
from myowave.diagnosis.study.cases import study_effect
from myowave.physics.build import build_model
from myowave.physics.effects import catalogue
from myowave.settings import Diagnosis, Physics, SimulatedDataset
from myowave.workflow.job import job_log

hidden = snakemake.wildcards.hidden
with job_log(f"study {hidden}", snakemake.log[0]) as log:
    physics = Physics.model_validate(snakemake.params.physics)
    cases = study_effect(
        hidden,
        [read_trials(path) for path in snakemake.input.trials],
        SimulatedDataset.model_validate(snakemake.params.dataset),
        Diagnosis.model_validate(snakemake.params.diagnosis),
        build_model("base", physics),
        catalogue(physics.effect_files),
        log.progress,
    )
    cases.to_csv(snakemake.output.cases, index=False)
