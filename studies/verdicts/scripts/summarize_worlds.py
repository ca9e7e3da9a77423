"""Put all cases together: how often the diagnosis was right, world by world, as a page and a picture."""

from pathlib import Path

import pandas as pd

from myowave.diagnosis.report.cells import with_texts
from myowave.plotting import save
from myowave.workflow.job import job_log
from studies.verdicts.figures import draw_rates
from studies.verdicts.summary import summarize, write_page

with job_log("summarize worlds", snakemake.log[0]):
    rows = pd.concat(pd.read_csv(path, keep_default_na=False, na_values=[""]) for path in snakemake.input.cases)
    rows = with_texts(rows, ["found", "taken_out", "nearest", "or_else", "absorbed", "recording"])
    rows.to_csv(snakemake.output.cases, index=False)
    summary = summarize(rows)
    summary.to_csv(snakemake.output.summary, index=False)
    Path(snakemake.output.page).write_text(write_page(summary), encoding="utf-8")
    save(draw_rates(summary), snakemake.output.figure)
