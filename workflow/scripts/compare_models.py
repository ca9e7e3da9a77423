"""Compare the fitted models of a dataset with its trials by torque, short horizons, whole trials."""

from functools import partial
from pathlib import Path

import pandas as pd

from myowave.data.store import read_trials
from myowave.diagnosis.comparison.compare import compare_models
from myowave.models import build_model
from myowave.settings import Physics
from myowave.workflow.job import job_log

inputs = snakemake.input
with job_log(f"compare models of {snakemake.wildcards.dataset}", snakemake.log[0]):
    physics = Physics.model_validate(snakemake.params.physics)
    tables = compare_models(
        read_trials(inputs.trials),
        partial(build_model, physics=physics),
        pd.read_csv(inputs.parameters),
        pd.read_csv(inputs.errors, dtype={"trial": str}),
    )
    for path in snakemake.output.tables:
        tables[Path(path).stem].to_csv(path, index=False)
