"""Tell the diagnosis of a dataset on one page that needs nothing else."""

from pathlib import Path

import pandas as pd

from myowave.data.json_files import read_json
from myowave.diagnosis.report.cells import read_ranking
from myowave.diagnosis.report.motion import read_beside
from myowave.diagnosis.report.page import Story, write_page
from myowave.workflow.job import job_log

inputs = snakemake.input
with job_log(f"tell verdict of {snakemake.wildcards.dataset}", snakemake.log[0]):
    networks = Path("results/learning", snakemake.wildcards.dataset)
    verdict, ladder = read_json(inputs.verdict), pd.read_csv(inputs.ladder)
    story = Story(
        verdict=verdict,
        ladder=ladder,
        parameters=pd.read_csv(inputs.parameters),
        ranking=read_ranking(inputs.ranking),
        predictions=read_beside(inputs.predictions, ladder, verdict["model"], networks),
        images={Path(path).stem: Path(path) for path in inputs.figures},
        draft=Path(inputs.draft).read_text(encoding="utf-8"),
        doubts=read_json(inputs.quality)["lines"] if inputs.quality else [],
        files=True,
    )
    Path(snakemake.output.page).write_text(write_page(story), encoding="utf-8")
