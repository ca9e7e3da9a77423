"""Find what the residual itself finds along perfect angles, without any network."""

from myowave.data.store import read_trials
from myowave.models import build_model
from myowave.settings import Physics
from myowave.workflow.job import job_log
from studies.paper.bias import tabulate_bias
from studies.paper.sampled import sampled
from studies.paper.tables import PARAMETERS

with job_log("measure the bias of the residual", snakemake.log[0]):
    model = build_model("base", Physics.model_validate(snakemake.params.physics))
    trials = [read_trials(path) for path in snakemake.input.trials]
    table = tabulate_bias(model, [*trials, sampled(model, trials[0])], PARAMETERS)
    table.to_csv(snakemake.output.bias, index=False)
