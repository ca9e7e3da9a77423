"""Draw what the diagnosis answered for each hidden effect."""

import json
from pathlib import Path

import pandas as pd

from myowave.diagnosis.study.figures import draw_study
from myowave.plotting import save
from myowave.workflow.job import job_log

with job_log("draw study", snakemake.log[0]):
    cases = pd.read_csv(snakemake.input.cases, keep_default_na=False)
    summary = json.loads(Path(snakemake.input.summary).read_text(encoding="utf-8"))
    save(draw_study(cases, summary), snakemake.output.figure)
