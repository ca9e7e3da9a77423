"""Judge the sets of one draw of one world."""

from pathlib import Path

import pandas as pd

from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.settings import Physics
from myowave.workflow.job import job_log
from studies.verdicts.judges import judge_set
from studies.verdicts.sets import read_sets

with job_log(f"judge sets of {snakemake.wildcards.world}", snakemake.log[0]) as log:
    physics = Physics.model_validate(snakemake.params.physics)
    base, effects = build_model("base", physics), catalogue(physics.effect_files)
    sets, rows = read_sets(Path(snakemake.input.sets)), []
    for done, drawn in enumerate(sets, 1):
        fit = drawn.fit(base)
        rows += [judge_set(drawn, judge, fit, effects) for judge in snakemake.params.judges]
        log.progress(done, len(sets), "")
    pd.DataFrame(rows).to_csv(snakemake.output.cases, index=False)
