"""Judge the ways over all draws, and say where more scales help."""

from pathlib import Path

import pandas as pd

from myowave.plotting import save
from myowave.workflow.job import job_log
from studies.scales.figures import draw_comparison
from studies.scales.judge import judge
from studies.scales.page import write_page

with job_log("judge ways", snakemake.log[0]) as log:
    scores = pd.concat([pd.read_csv(path) for path in snakemake.input.scores], ignore_index=True)
    judged = judge(scores)
    judged.to_csv(snakemake.output.table, index=False, float_format="%.4g")
    page = write_page(judged, scores, snakemake.params.study, Path(snakemake.output.picture).name)
    Path(snakemake.output.page).write_text(page, encoding="utf-8")
    save(draw_comparison(judged), snakemake.output.picture)
    log.announce(page.splitlines()[2])
