# Where do more scales help? Arms that differ in one thing, on several kinds of data: `snakemake multiresolution`, and with
# all conditions, which is work for a cluster, `snakemake multiresolution_full`.
COMPARED = SETTINGS.learning.multiresolution


def conditions(full):
    return [name for name, condition in COMPARED.conditions.items() if full or not condition.full]


def compared_arms(full):
    """Scores of all draws of the conditions."""
    return [
        f"results/learning/multiresolution/{name}/{dataset}-{draw}.csv"
        for name in conditions(full)
        for dataset in COMPARED.conditions[name].datasets or COMPARED.datasets
        for draw in range(COMPARED.draws)
    ]


def recorded_trials(wildcards):
    """Trials that were recorded; those that are simulated are made anew in each draw."""
    return [] if wildcards.dataset in SIMULATED else [f"results/data/{wildcards.dataset}/trials.parquet"]


localrules:
    multiresolution,
    multiresolution_full,


# What it writes to docs/ is shown by README, and small.
rule multiresolution:
    input:
        expand("docs/multiresolution.{ending}", ending=["md", "png", "csv"]),


rule multiresolution_full:
    input:
        expand("results/multiresolution/full.{ending}", ending=["md", "png", "csv"]),


rule compare_arms:
    input:
        trials=recorded_trials,
        physics=physics_files,
    output:
        scores="results/learning/multiresolution/{condition}/{dataset}-{draw}.csv",
    log:
        "results/logs/compare_arms/{condition}/{dataset}-{draw}.log",
    wildcard_constraints:
        condition=one_of(COMPARED.conditions),
        draw=r"\d+",
    threads: 1
    params:
        physics=physics_section,
        contents=physics_contents,
        dataset=lambda wildcards: dump(DATASETS[wildcards.dataset]),  # simulated trials are made here
        rate_hz=lambda wildcards: COMPARED.datasets[wildcards.dataset].rate_hz,
        recipe=lambda wildcards: dump(COMPARED.recipe_of(wildcards.condition, SETTINGS.learning.recipes)),
        arms=lambda wildcards: list(COMPARED.conditions[wildcards.condition].arms),
        scales=COMPARED.scales,
        seeds=COMPARED.seeds,
        code=digest("compare_arms"),
    script:
        "../scripts/compare_arms.py"


rule judge_arms:
    input:
        scores=compared_arms(full=False),
    output:
        page="docs/multiresolution.md",
        picture="docs/multiresolution.png",
        table="docs/multiresolution.csv",
    log:
        "results/logs/judge_arms.log",
    params:
        study=dump(COMPARED),
        code=digest("judge_arms"),
    script:
        "../scripts/judge_arms.py"


use rule judge_arms as judge_all_arms with:
    input:
        scores=compared_arms(full=True),
    output:
        page="results/multiresolution/full.md",
        picture="results/multiresolution/full.png",
        table="results/multiresolution/full.csv",
    log:
        "results/logs/judge_all_arms.log",
