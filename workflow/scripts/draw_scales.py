"""Draw a trial of a dataset at each scale."""

from myowave.data.figures import draw_scales
from myowave.data.store import read_scales
from myowave.job import job_log
from myowave.plotting import save

with job_log(f"draw scales of {snakemake.wildcards.dataset}", snakemake.log[0]):
    save(draw_scales(read_scales(snakemake.input.scales)), snakemake.output.figure)
