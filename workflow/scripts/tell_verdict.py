"""Tell the diagnosis of a dataset on one page that needs nothing else."""

import json
from pathlib import Path

import pandas as pd

from myowave.data.store import read_table
from myowave.diagnosis.report.cells import with_texts
from myowave.diagnosis.report.page import Story, write_page
from myowave.workflow.job import job_log

inputs = snakemake.input
with job_log(f"tell verdict of {snakemake.wildcards.dataset}", snakemake.log[0]):
    story = Story(
        verdict=json.loads(Path(inputs.verdict).read_text(encoding="utf-8")),
        ladder=pd.read_csv(inputs.ladder),
        parameters=pd.read_csv(inputs.parameters),
        ranking=with_texts(pd.read_csv(inputs.ranking)),
        proposals=pd.read_csv(inputs.proposals),
        predictions=read_table(inputs.predictions)[0],
        images={Path(path).stem: Path(path) for path in inputs.figures},
        draft=Path(inputs.draft).read_text(encoding="utf-8"),
    )
    Path(snakemake.output.page).write_text(write_page(story, Path(inputs.template)), encoding="utf-8")
