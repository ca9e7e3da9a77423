"""Draw the raw recordings of a session with what was made of them and found in them, a picture per trial."""

from myowave.data.figures import draw_recording
from myowave.data.importing import prepare
from myowave.data.json_files import read_json
from myowave.data.reading import read_session
from myowave.plotting import save
from myowave.settings import RecordedDataset
from myowave.workflow.job import job_log

name = snakemake.wildcards.dataset
with job_log(f"draw recording of {name}", snakemake.log[0]):
    dataset, quality = RecordedDataset.model_validate(snakemake.params.dataset), read_json(snakemake.input.quality)
    prepared = prepare(name, dataset, read_session(name, dataset))
    for trial in dataset.trials:
        save(draw_recording(prepared, quality, trial), f"{snakemake.output.pictures}/{trial}.png")
