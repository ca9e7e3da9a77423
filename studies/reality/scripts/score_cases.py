"""Set the answers beside the truth, as a table and a picture."""

from pathlib import Path

from myowave.data.json_files import read_json
from myowave.plotting import save
from myowave.settings.files import read_yaml
from myowave.workflow.job import job_log
from studies.reality.figures import draw_reality
from studies.reality.page import write_page
from studies.reality.score import score_cases

with job_log("score cases", snakemake.log[0]) as log:
    cases = snakemake.params.cases
    answers = {Path(path).stem: read_json(path) for path in snakemake.input.answers}
    table = score_cases(cases, answers, read_yaml(Path(snakemake.input.truth), "cases"))
    for path in (snakemake.output.table, snakemake.output.kept):
        table.to_csv(path, index=False)
    Path(snakemake.output.page).write_text(write_page(table), encoding="utf-8")
    save(draw_reality(table), snakemake.output.picture)
    log.announce(f"reality: {', '.join(f'{count} {grade}' for grade, count in table['grade'].value_counts().items())}")
