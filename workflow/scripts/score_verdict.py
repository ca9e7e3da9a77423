"""Write a verdict: what was found and compared, errors where the truth is known, and the command that adds it."""

import pandas as pd

from myowave.data.json_files import read_json, write_json
from myowave.diagnosis.comparison.summary import summarize
from myowave.diagnosis.report.tell import adding_command, tell
from myowave.diagnosis.scoring import add_truth
from myowave.workflow.job import job_log

with job_log(f"verdict of {snakemake.wildcards.dataset}", snakemake.log[0]) as log:
    summary = read_json(snakemake.input.summary)
    truth = read_json(snakemake.input.truth) if snakemake.input.truth else None
    compared = summarize(pd.read_csv(snakemake.input.torque), pd.read_csv(snakemake.input.horizons))
    command = adding_command(summary, **snakemake.params.run)
    verdict = {**add_truth(summary, truth), **compared, "command": command}
    write_json(verdict, snakemake.output.verdict)
    log.say(tell(verdict)["headline"])
