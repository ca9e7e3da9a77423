# Many subjects, from the table data.subjects: `snakemake subjects`. Each subject has its own jobs.
from myowave.settings.subjects import read_subjects

SUBJECTS = list(read_subjects(Path(SETTINGS.data.subjects))) if SETTINGS.data.subjects else []


rule subjects:
    input:
        for_targets(f"results/learning/{NETWORK}/evaluation.csv", SUBJECTS),
        "results/subjects.csv",
        "results/figures/subjects.png",


rule summarize_subjects:
    input:
        verdicts=expand("results/diagnosis/{dataset}/verdict.json", dataset=SUBJECTS),
    output:
        table=report(
            "results/subjects.csv",
            caption="../report/subjects.rst",
            category="4 subjects",
            labels={"figure": "table"},
        ),
        figure=report(
            "results/figures/subjects.png",
            caption="../report/subjects.rst",
            category="4 subjects",
            labels={"figure": "overview"},
        ),
    log:
        "results/logs/summarize_subjects.log",
    params:
        code=digest("summarize_subjects"),
    script:
        "../scripts/summarize_subjects.py"
