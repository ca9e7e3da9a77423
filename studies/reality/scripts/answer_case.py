"""Ask the diagnosis, and others, what is missing in a case."""

from myowave.data.store import read_trials, write_json
from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.settings import DiagnosisSettings, Identify, Physics
from myowave.workflow.job import job_log
from studies.reality.answer import answer_case
from studies.reality.rivals import lasso, pysindy

name = snakemake.wildcards.case
with job_log(f"answer case {name}", snakemake.log[0]) as log:
    physics = Physics.model_validate(snakemake.params.physics)
    base, trials = build_model("base", physics), read_trials(snakemake.input.trials)
    effects = {n: e for n, e in catalogue(physics.effect_files).items() if n not in snakemake.params.leave_out}
    identify = {n: Identify.model_validate(values) for n, values in snakemake.params.identify.items()}
    settings = DiagnosisSettings.model_validate(snakemake.params.diagnosis)
    answer = answer_case(trials, base, effects, identify, settings, log.say)
    write_json(
        {**answer, "lasso": lasso(trials, base, effects), "pysindy": pysindy(trials, base)}, snakemake.output.answer
    )
