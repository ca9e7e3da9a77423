"""Hide an effect in simulated trials, in all strengths, seeds and noises, and diagnose each."""

from myowave.data.store import read_trials
from myowave.diagnosis.study.cases import study_effect
from myowave.physics.build import build_model
from myowave.physics.effects import catalogue
from myowave.settings import parse_section
from myowave.workflow.job import job_log

hidden = snakemake.wildcards.hidden
with job_log(f"study {hidden}", snakemake.log[0]) as log:
    physics = parse_section("physics", snakemake.params.physics)
    cases = study_effect(
        hidden,
        [read_trials(path) for path in snakemake.input.trials],
        parse_section("data.datasets.study", snakemake.params.dataset),
        parse_section("diagnosis", snakemake.params.diagnosis),
        build_model("base", physics),
        catalogue(physics.effect_files),
        log.progress,
    )
    cases.to_csv(snakemake.output.cases, index=False)
