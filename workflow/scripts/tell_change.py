"""Find out what changed between two groups of trials, and tell it on a page."""

from pathlib import Path

from myowave.data.json_files import write_json
from myowave.data.store import read_trials
from myowave.diagnosis.changed.ask import what_changed
from myowave.diagnosis.report.change import change_page, changed_facts
from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.settings import Physics, Scatter
from myowave.settings.data import Changed
from myowave.workflow.job import job_log

outputs, params = snakemake.output, snakemake.params
with job_log(f"what changed in {snakemake.wildcards.dataset}", snakemake.log[0]) as log:
    physics = Physics.model_validate(params.physics)
    found = what_changed(
        read_trials(snakemake.input.trials),
        build_model("base", physics),
        catalogue(physics.effect_files).values(),
        Changed.model_validate(params.changed),
        {name: Scatter.model_validate(scatter) for name, scatter in params.scatter.items()},
        log.say,
        workers=snakemake.threads,
    )
    facts = changed_facts(snakemake.wildcards.dataset, found)
    write_json(facts, outputs.facts)
    Path(outputs.page).write_text(change_page(facts), encoding="utf-8")
