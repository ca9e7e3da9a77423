"""Bring the verdicts and parameters of all subjects into one table and one picture."""

from myowave.diagnosis.subjects.figures import draw_subjects
from myowave.diagnosis.subjects.table import tabulate_subjects
from myowave.plotting import save
from myowave.workflow.job import job_log

with job_log("summarize subjects", snakemake.log[0]):
    table = tabulate_subjects(snakemake.input.verdicts)
    table.to_csv(snakemake.output.table, index=False)
    save(draw_subjects(table), snakemake.output.figure)
