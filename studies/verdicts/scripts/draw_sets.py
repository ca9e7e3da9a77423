"""Make the sets of one draw of one world and fit the model to each."""

from pathlib import Path

from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.settings import DiagnosisSettings, Physics, SimulatedDataset
from myowave.workflow.job import job_log
from studies.verdicts.cases import list_cases
from studies.verdicts.sets import draw_set, write_sets
from studies.verdicts.settings import Verdicts

world, draw = snakemake.wildcards.world, int(snakemake.wildcards.draw)
with job_log(f"sets of world {world}, draw {draw}", snakemake.log[0]) as log:
    physics = Physics.model_validate(snakemake.params.physics)
    settings = DiagnosisSettings.model_validate(snakemake.params.diagnosis)
    base, effects = build_model("base", physics), catalogue(physics.effect_files)
    plan = Verdicts.model_validate(snakemake.params.verdicts)
    dataset = SimulatedDataset.model_validate(snakemake.params.dataset)
    cases = [case for case in list_cases(base, effects, plan) if (case.world, case.draw) == (world, draw)]
    sets = []
    for done, case in enumerate(cases, 1):
        drawn = draw_set(case, dataset, settings, base, effects)
        sets += [drawn] if drawn is not None else []
        log.progress(done, len(cases), "")
    write_sets(sets, Path(snakemake.output.sets))
