"""Put the cases of the study together: how often the diagnosis was right, and what it took for what."""

import pandas as pd

from myowave.data.store import write_json
from myowave.diagnosis.study.cases import confusion_matrix, summarize
from myowave.workflow.job import job_log

with job_log("summarize study", snakemake.log[0]):
    cases = pd.concat([pd.read_csv(path, keep_default_na=False) for path in snakemake.input.cases], ignore_index=True)
    cases.to_csv(snakemake.output.cases, index=False)
    confusion_matrix(cases).to_csv(snakemake.output.confusion)
    write_json(summarize(cases), snakemake.output.summary)
