"""Draw the raw recordings of a session with what was made of them, a picture per trial."""

from myowave.data.figures import draw_recording
from myowave.data.importing import import_trials
from myowave.plotting import save
from myowave.settings import RecordedDataset
from myowave.workflow.job import job_log

name = snakemake.wildcards.dataset
with job_log(f"draw recording of {name}", snakemake.log[0]):
    dataset = RecordedDataset.model_validate(snakemake.params.dataset)
    prepared, quality = import_trials(name, dataset)
    for trial in dataset.trials:
        save(draw_recording(prepared, quality, trial), f"{snakemake.output.pictures}/{trial}.png")
