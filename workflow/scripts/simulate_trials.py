"""Simulate the trials of a dataset, and keep apart what they were made with."""

from myowave.data.json_files import write_json
from myowave.data.simulate import simulate_trials
from myowave.data.store import write_trials
from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.settings import Physics, SimulatedDataset
from myowave.workflow.job import job_log

name = snakemake.wildcards.dataset
with job_log(f"simulate trials of {name}", snakemake.log[0]):
    physics = Physics.model_validate(snakemake.params.physics)
    dataset = SimulatedDataset.model_validate(snakemake.params.dataset)
    base = build_model("base", physics)
    trials, truth = simulate_trials(name, dataset, base, catalogue(physics.effect_files))
    write_trials(trials, snakemake.output.trials)
    write_json(truth, snakemake.output.truth)
