"""Train networks with one choice of trials held out, and score them on these, running free."""

from myowave.data.store import read_trials
from myowave.data.thinning import thin
from myowave.data.wavelets import decompose
from myowave.learning.evaluation import evaluate, predict_trials
from myowave.learning.task import Task
from myowave.learning.training import train_scales
from myowave.models import build_model
from myowave.settings import Identify, Physics, Wavelet, parse_recipe
from myowave.workflow.job import job_log
from studies.held_out.table import SEPARATOR, hold_out

params, total = snakemake.params, int(snakemake.wildcards.scales)
label = f"held out {SEPARATOR.join(params.test)}, {params.name} {total}-scale"
with job_log(label, snakemake.log[0]) as log:
    recipe, wavelet = parse_recipe(params.recipe), Wavelet.model_validate(params.wavelet)
    trials = thin(hold_out(read_trials(snakemake.input.trials), params.test), recipe.rate_hz)
    task = Task(
        decompose(trials, total - 1, wavelet.name),
        build_model("base", Physics.model_validate(params.physics)),
        recipe,
        {name: Identify.model_validate(values) for name, values in params.identify.items()},
        total=total,
        seeds=range(params.seeds),
        band=False,
    )
    for checkpoint in train_scales(task):
        log.progress(total - checkpoint.level, total, f"scale {-checkpoint.level} is trained")
    rows = evaluate(checkpoint, trials, predict_trials(checkpoint, trials), recipe=params.name)
    rows.insert(0, "held_out", SEPARATOR.join(params.test))
    rows.to_csv(snakemake.output.scores, index=False)
