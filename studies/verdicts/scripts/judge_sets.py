"""Judge the sets of one draw of one world."""

from pathlib import Path

import pandas as pd

from myowave.physics.effects import catalogue
from myowave.workflow.job import job_log
from studies.verdicts.judges import judge_set
from studies.verdicts.sets import read_sets

with job_log(f"judge sets of {snakemake.wildcards.world}", snakemake.log[0]) as log:
    effects, sets, rows = catalogue(snakemake.params.effect_files), read_sets(Path(snakemake.input.sets)), []
    for done, drawn in enumerate(sets, 1):
        rows += [judge_set(drawn, judge, effects) for judge in snakemake.params.judges]
        log.progress(done, len(sets), "")
    pd.DataFrame(rows).to_csv(snakemake.output.cases, index=False)
