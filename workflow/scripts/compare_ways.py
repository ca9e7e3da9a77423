"""Train networks that physics teaches in each of the ways, and score them on the test trials, running free."""

import pandas as pd

from myowave.data.store import read_trials
from myowave.data.thinning import thin
from myowave.data.wavelets import decompose
from myowave.learning.evaluation import evaluate, predict_trials
from myowave.learning.task import Task
from myowave.learning.teaching import WAYS, taught_by
from myowave.learning.training import train_scales
from myowave.models import build_model
from myowave.settings import Identify, Physics, Recipe, Wavelet
from myowave.workflow.job import job_log

where, params, rows = snakemake.wildcards, snakemake.params, []
with job_log(f"what physics teaches {where.dataset} {where.model} {where.scales}-scale", snakemake.log[0]) as log:
    recipe, wavelet = Recipe.model_validate(params.recipe), Wavelet.model_validate(params.wavelet)
    total = int(where.scales)
    trials = thin(read_trials(snakemake.input.trials), recipe.rate_hz)
    scales = decompose(trials, total - 1, wavelet.name, wavelet.decompose)
    model = build_model(where.model, Physics.model_validate(params.physics))
    wanted = {name: Identify.model_validate(values) for name, values in params.identify.items()}
    for way in WAYS:
        task = Task(scales, model, taught_by(recipe, way, params.beta), wanted, total=total, seeds=range(params.seeds))
        *_, checkpoint = train_scales(task)
        rows.append(
            evaluate(checkpoint, trials, predict_trials(checkpoint, trials), recipe=params.name).assign(way=way)
        )
        log.progress(len(rows), len(WAYS), f"taught by {way} in {checkpoint.seconds:.0f} s")
    pd.concat(rows).to_csv(snakemake.output.scores, index=False)
