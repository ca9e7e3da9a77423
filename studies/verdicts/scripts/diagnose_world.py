"""Diagnose a part of the cases of one world."""

from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.settings import DiagnosisSettings, Physics, SimulatedDataset
from myowave.workflow.job import job_log
from studies.verdicts.cases import diagnose_world, list_cases
from studies.verdicts.settings import Verdicts

world, part = snakemake.wildcards.world, int(snakemake.wildcards.part)
with job_log(f"diagnose world {world}, part {part}", snakemake.log[0]) as log:
    physics = Physics.model_validate(snakemake.params.physics)
    settings = DiagnosisSettings.model_validate(snakemake.params.diagnosis)
    base, effects = build_model("base", physics), catalogue(physics.effect_files)
    plan = Verdicts.model_validate(snakemake.params.verdicts)
    cases = list_cases(world, base, effects, plan)[part :: plan.parts]
    dataset = SimulatedDataset.model_validate(snakemake.params.dataset)
    rows = diagnose_world(cases, dataset, settings, base, effects, log.progress)
    rows.to_csv(snakemake.output.cases, index=False)
