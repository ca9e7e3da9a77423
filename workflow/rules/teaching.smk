# What physics teaches the network: simulated trials, the residual along its rollouts, both, neither: `snakemake teaching`.
# Its table stands in docs/.
TEACHING = SETTINGS.learning.teaching
TAUGHT = "results/learning/teaching/{dataset}/{model}/{scales}-scale.csv"


localrules:
    teaching,


rule teaching:
    input:
        "docs/teaching.md",


rule compare_ways:
    input:
        trials="results/data/{dataset}/trials.parquet",
        physics=physics_files,
    output:
        scores=TAUGHT,
    log:
        "results/logs/compare_ways/{dataset}/{model}/{scales}-scale.log",
    threads: 1
    params:
        physics=physics_section,
        contents=physics_contents,
        identify=identify_section,
        recipe=lambda wildcards: dump(SETTINGS.learning.recipes[SETTINGS.targets.recipes_of(wildcards.dataset)[0]]),
        name=lambda wildcards: SETTINGS.targets.recipes_of(wildcards.dataset)[0],
        beta=TEACHING.beta,
        wavelet=dump(SETTINGS.data.wavelet),
        seeds=SETTINGS.learning.seeds,
        code=digest("compare_ways"),
    script:
        "../scripts/compare_ways.py"


rule tabulate_ways:
    input:
        scores=[
            TAUGHT.format(dataset=dataset, model=model, scales=scales)
            for dataset, models in TEACHING.models.items()
            for model in models
            for scales in TEACHING.scales
        ],
    output:
        table="results/learning/teaching/ways.csv",
        page="docs/teaching.md",
    log:
        "results/logs/tabulate_ways.log",
    params:
        study=dump(TEACHING),
        code=digest("tabulate_ways"),
    script:
        "../scripts/tabulate_ways.py"
