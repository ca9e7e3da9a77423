# The paper's own recipe on its own protocols (Secs. 4 and 5), beside its printed values: `snakemake paper --cores 2`.
# Its page stands in docs/.
PAPER_CASES = ["case1", "case2", "case3"]
PAPER_SUBJECTS = ["elbow_literature", "elbow_bounds"]
PAPER_BEST = "paper_split"  # what comes out best of all readings, also on further draws
PAPER_DRAWS = ["case1_again", "case1_third"]
PAPER_HELD = "case1_held"
PAPER_RUNS = [
    *(f"{case}/base/paper" for case in PAPER_CASES),
    *(f"{case}/base/{PAPER_BEST}" for case in PAPER_CASES),
    *(f"{name}/base/paper_subject" for name in PAPER_SUBJECTS),
]

# What each choice of its recipe does, on one case with 1-scale training; the recipe as printed comes first.
PAPER_CHOICES = [
    "paper", "paper_rnn", "paper_light", "paper_sequence", "paper_sequence_light", "paper_five_steps", "paper_averaged",
    "paper_measured", "paper_two_steps", "paper_delayed", PAPER_BEST,
]  # fmt: skip
PAPER_SIMULATED = PAPER_CASES + PAPER_DRAWS + [PAPER_HELD]
PAPER_CHOICE = "results/learning/case1/base/{recipe}/1-scale/{file}"


def of_shipped(files):
    """An input function: these files, where the configuration has what the paper's protocols need."""

    def found(wildcards):
        named = [
            *(f"data.datasets.{name}" for name in PAPER_SIMULATED + PAPER_SUBJECTS if name not in DATASETS),
            *(
                f"learning.recipes.{name}"
                for name in [*PAPER_CHOICES, "paper_subject"]
                if name not in SETTINGS.learning.recipes
            ),
        ]
        if named:
            sys.exit(
                f"The paper's protocols need {', '.join(named)}, which the configuration does not have. Lay your files over "
                "the config.yaml that ships: --configfile config.yaml mine.yaml."
            )
        return files

    return found


def paper_scales(dataset):
    """Numbers of scales: 1 to 3 in Sec. 4, 1 to 5 in Sec. 5; further draws and true bounds, which the paper lacks, ends."""
    ends = {"elbow_literature": [1, 2, 3, 4, 5], "elbow_bounds": [1, 5]} | dict.fromkeys(PAPER_DRAWS, [1, 3])
    return ends.get(dataset, [1, 2, 3])


def of_paper(pattern):
    """An input function: the pattern for every number of scales, and every level within."""
    return lambda wildcards: sorted(
        {
            pattern.format(**wildcards, scales=scales, level=level)
            for scales in paper_scales(wildcards.dataset)
            for level in range(scales)
        }
    )


def paper_evaluations(datasets, recipe, file="evaluation.csv"):
    return [
        f"results/learning/{dataset}/base/{recipe}/{scales}-scale/{file}"
        for dataset in datasets
        for scales in paper_scales(dataset)
    ]


def of_cases(file="evaluation.csv"):
    """A file of every network of Sec. 4: as printed, and as it comes out best."""
    return paper_evaluations(PAPER_CASES, "paper", file) + paper_evaluations(
        PAPER_CASES + PAPER_DRAWS, PAPER_BEST, file
    )


def paper_runs(file):
    """A file of every network of the paper's protocols."""
    protocols = of_cases(file) + paper_evaluations(PAPER_SUBJECTS, "paper_subject", file)
    return list(dict.fromkeys(protocols + expand(PAPER_CHOICE, recipe=PAPER_CHOICES, file=file)))


localrules:
    paper,


rule paper:
    input:
        of_shipped("docs/paper.md"),
        expand("results/paper/{run}/{figure}.png", run=PAPER_RUNS, figure=["metrics", "predictions", "parameters"]),


rule score_one_step:
    input:
        checkpoints=of_shipped(paper_runs("scale-0.pt")),
        trials=expand("results/data/{dataset}/trials.parquet", dataset=PAPER_CASES + PAPER_DRAWS + PAPER_SUBJECTS),
    output:
        scores="results/paper/one_step.csv",
    log:
        "results/logs/score_one_step.log",
    params:
        code=digest("score_one_step"),
    script:
        "../scripts/score_one_step.py"


# What the equation itself finds along perfect angles.
rule measure_bias:
    input:
        trials=of_shipped(expand("results/data/{dataset}/trials.parquet", dataset=PAPER_SIMULATED)),
    output:
        bias="results/paper/bias.csv",
    log:
        "results/logs/measure_bias.log",
    params:
        physics=lambda wildcards: dump(SETTINGS.physics_of(PAPER_CASES[0])),
        code=digest("measure_bias"),
    script:
        "../scripts/measure_bias.py"


rule compare_paper:
    input:
        cases=of_shipped(of_cases()),
        convergence=[
            f"results/learning/{case}/base/{PAPER_BEST}/{scales}-scale/history-{level}.parquet"
            for case in PAPER_CASES
            for scales in paper_scales(case)
            for level in range(scales)
        ],
        bias="results/paper/bias.csv",
        choices=expand(PAPER_CHOICE, recipe=PAPER_CHOICES, file="evaluation.csv"),
        histories=expand(PAPER_CHOICE, recipe=PAPER_CHOICES, file="history-0.parquet"),
        subject=paper_evaluations(PAPER_SUBJECTS, "paper_subject"),
        one_step="results/paper/one_step.csv",
    output:
        page="docs/paper.md",
        table3="results/paper/table3.csv",
        table4="results/paper/table4.csv",
        table5="results/paper/table5.csv",
        choices="results/paper/choices.csv",
        scales="docs/paper_scales.png",
        errors="docs/paper_errors.png",
        derivatives="docs/paper_derivatives.png",
        convergence="docs/paper_convergence.png",
    log:
        "results/logs/compare_paper.log",
    params:
        recipes=lambda wildcards: {name: dump(SETTINGS.learning.recipes[name]) for name in PAPER_CHOICES},
        best=PAPER_BEST,
        identify=lambda wildcards: {name: public(DATASETS[name])["identify"] for name in PAPER_SUBJECTS},
        code=digest("compare_paper"),
    script:
        "../scripts/compare_paper.py"


rule draw_paper:
    input:
        evaluations=of_paper(f"results/learning/{NETWORK}/evaluation.csv"),
        predictions=of_paper(f"results/learning/{NETWORK}/predictions.parquet"),
        histories=of_paper(f"results/learning/{NETWORK}/history-{{level}}.parquet"),
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
