"""Ask the diagnosis, and others, what is missing in a case or what changed."""

from myowave.data.json_files import write_json
from myowave.data.store import read_trials
from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.settings import DiagnosisSettings, Identify, Physics
from myowave.workflow.job import job_log
from studies.reality.answer import answer_case
from studies.reality.settings import Case

params = snakemake.params
with job_log(f"answer case {snakemake.wildcards.case}", snakemake.log[0]) as log:
    physics, trials = Physics.model_validate(params.physics), read_trials(snakemake.input.trials)
    base, effects = build_model("base", physics), catalogue(physics.effect_files)
    identify = {n: Identify.model_validate(values) for n, values in params.identify.items()}
    settings = DiagnosisSettings.model_validate(params.diagnosis)
    answer = answer_case(Case.model_validate(params.case), trials, base, effects, identify, settings, log.say)
    write_json(answer, snakemake.output.answer)
