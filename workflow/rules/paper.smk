# The paper's own recipe on its own protocols (Secs. 4 and 5), beside its printed values: `snakemake paper --cores 2`.

localrules:
    paper,


rule paper:
    input:
        "results/paper/tables.md",
        expand("results/paper/{run}/{figure}.png", run=PAPER_RUNS, figure=["metrics", "predictions", "parameters"]),


rule score_one_step:
    input:
        checkpoints=paper_runs("scale-0.pt"),
        trials=expand("results/data/{dataset}/trials.parquet", dataset=PAPER_CASES + PAPER_SUBJECTS),
    output:
        scores="results/paper/one_step.csv",
    log:
        "results/logs/score_one_step.log",
    params:
        code=digest("score_one_step"),
    script:
        "../scripts/score_one_step.py"


rule compare_paper:
    input:
        cases=paper_evaluations(PAPER_CASES, "paper"),
        choices=expand(PAPER_CHOICE, recipe=PAPER_CHOICES, file="evaluation.csv"),
        histories=expand(PAPER_CHOICE, recipe=PAPER_CHOICES, file="history-0.parquet"),
        subject=paper_evaluations(PAPER_SUBJECTS, "paper_subject"),
        one_step="results/paper/one_step.csv",
    output:
        page="results/paper/tables.md",
        table3="results/paper/table3.csv",
        table4="results/paper/table4.csv",
        table5="results/paper/table5.csv",
        choices="results/paper/choices.csv",
        scales="results/paper/scales.png",
        errors="results/paper/errors.png",
        derivatives="results/paper/derivatives.png",
    log:
        "results/logs/compare_paper.log",
    params:
        recipes={name: dump(SETTINGS.learning.recipes[name]) for name in PAPER_CHOICES},
        identify={name: public(DATASETS[name])["identify"] for name in PAPER_SUBJECTS},
        code=digest("compare_paper"),
    script:
        "../scripts/compare_paper.py"


rule draw_paper:
    input:
        evaluations=of_paper(f"results/learning/{LADDER}/evaluation.csv"),
        predictions=of_paper(f"results/learning/{LADDER}/predictions.parquet"),
        histories=of_paper(f"results/learning/{LADDER}/history-{{level}}.parquet"),
    output:
        metrics=f"results/paper/{RUNS}/metrics.png",
        predictions=f"results/paper/{RUNS}/predictions.png",
        parameters=f"results/paper/{RUNS}/parameters.png",
    log:
        f"results/logs/draw_paper/{RUNS}.log",
    params:
        identify=identify_section,
        code=digest("draw_models"),
    script:
        "../scripts/draw_models.py"
