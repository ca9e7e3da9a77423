"""Put all sets together: what the answers are worth, world by world, as a page, a picture and a table of all sets."""

import subprocess
from datetime import date
from pathlib import Path

import pandas as pd

from myowave.plotting import save
from myowave.workflow.job import job_log
from studies.verdicts.figures import draw_reliability
from studies.verdicts.summary import read_rows, write_page

with job_log("summarize sets", snakemake.log[0]):
    rows = pd.concat([read_rows(path) for path in (*snakemake.input.cases, snakemake.input.before)])
    rows.to_csv(snakemake.output.cases, index=False)
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
    page = write_page(rows, f"{date.today():%d %B %Y}", commit or "unknown")
    Path(snakemake.output.page).write_text(page, encoding="utf-8")
    save(draw_reliability(rows), snakemake.output.figure)
