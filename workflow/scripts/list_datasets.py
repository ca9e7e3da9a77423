"""List all datasets on one page: verdicts, errors, parameters, any of them side by side."""

import json
from pathlib import Path

import pandas as pd

from myowave.diagnosis.report.index import Entry, write_index
from myowave.workflow.job import job_log

inputs, params = snakemake.input, snakemake.params
with job_log("list datasets", snakemake.log[0]):
    entries = [
        Entry(
            verdict=json.loads(Path(verdict).read_text(encoding="utf-8")),
            parameters=pd.read_csv(parameters),
            torque=pd.read_csv(torque),
            horizons=pd.read_csv(horizons),
            settings=params.settings[Path(verdict).parent.name],
        )
        for verdict, parameters, torque, horizons in zip(
            inputs.verdicts, inputs.parameters, inputs.torque, inputs.horizons, strict=True
        )
    ]
    page = write_index(entries, params.links, Path(inputs.template))
    Path(snakemake.output.index).write_text(page, encoding="utf-8")
