"""Diagnose a dataset: what its trials say that the physical model misses."""

from pathlib import Path

from myowave.data.json_files import write_json
from myowave.data.store import read_trials, write_table
from myowave.diagnosis.report.facts import verdict_facts
from myowave.diagnosis.report.tables import TABLES, draft_source, predictions_table
from myowave.diagnosis.search.diagnose import diagnose
from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.settings import DiagnosisSettings, Identify, Physics
from myowave.workflow.job import job_log

name = snakemake.wildcards.dataset
with job_log(f"diagnose {name}", snakemake.log[0]) as log:
    physics = Physics.model_validate(snakemake.params.physics)
    diagnosis = diagnose(
        read_trials(snakemake.input.trials),
        build_model("base", physics),
        catalogue(physics.effect_files).values(),
        {n: Identify.model_validate(values) for n, values in snakemake.params.identify.items()},
        DiagnosisSettings.model_validate(snakemake.params.diagnosis),
        log.say,
        [build_model(model, physics) for model in snakemake.params.models],
    )
    for path in snakemake.output.tables:
        TABLES[Path(path).stem](diagnosis).to_csv(path, index=False)
    write_table(predictions_table(diagnosis), snakemake.output.predictions)
    Path(snakemake.output.draft).write_text(draft_source(diagnosis), encoding="utf-8")
    write_json(verdict_facts(diagnosis), snakemake.output.summary)
