"""Write a verdict, with the parameters' errors where the truth is known, and the command that adds what it found."""

import json
from pathlib import Path

from myowave.data.store import write_json
from myowave.diagnosis.report.command import adding_command
from myowave.diagnosis.scoring import add_truth
from myowave.workflow.job import job_log

with job_log(f"verdict of {snakemake.wildcards.dataset}", snakemake.log[0]):
    summary = json.loads(Path(snakemake.input.summary).read_text(encoding="utf-8"))
    truth = json.loads(Path(snakemake.input.truth).read_text(encoding="utf-8")) if snakemake.input.truth else None
    command = adding_command(summary["dataset"], summary["model"], **snakemake.params.run)
    write_json({**add_truth(summary, truth), "command": command}, snakemake.output.verdict)
