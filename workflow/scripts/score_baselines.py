"""Score predictors without physics or scales on the trials that networks are tested on."""

from pathlib import Path

from myowave.data.json_files import replacing
from myowave.data.store import read_trials
from myowave.learning.baselines import score_baseline
from myowave.models import build_model
from myowave.settings import Baseline, Physics
from myowave.workflow.job import job_log

where, params = snakemake.wildcards, snakemake.params
with job_log(f"baselines of {where.dataset}", snakemake.log[0]) as log:
    trials = read_trials(snakemake.input.trials)
    model = build_model("base", Physics.model_validate(params.physics))
    for i, path in enumerate(map(Path, snakemake.output)):
        name = path.parts[-3]
        baseline = Baseline.model_validate(params.baselines[name])
        rows = score_baseline(baseline, trials, model, range(params.seeds), name=name)
        with replacing(path) as temporary:
            rows.to_csv(temporary, index=False)
        log.progress(i + 1, len(snakemake.output), f"{name}: R2 {rows['test_r2'].median():.3f}")
