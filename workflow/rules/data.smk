# Trials, simulated or measured, become one table; after it nobody asks which they were.


rule simulate_trials:
    input:
        physics=SETTINGS.physics.files,
    output:
        trials="results/data/{dataset}/trials.parquet",
        truth="results/data/{dataset}/truth.json",
    log:
        "results/logs/simulate_trials/{dataset}.log",
    wildcard_constraints:
        dataset=one_of(SIMULATED),
    params:
        physics=section("physics"),
        dataset=lambda wildcards: dump(DATASETS[wildcards.dataset]),  # with what is hidden: this rule puts it in
        code=digest("simulate_trials"),
    script:
        "../scripts/simulate_trials.py"


rule import_trials:
    input:
        recordings=recordings,  # so that a changed file is imported again
    output:
        trials="results/data/{dataset}/trials.parquet",
    log:
        "results/logs/import_trials/{dataset}.log",
    wildcard_constraints:
        dataset=one_of(MEASURED),
    params:
        dataset=dataset_section,
        channels=list(dict.fromkeys(muscle.emg for muscle in SETTINGS.physics.muscles.values())),
        code=digest("import_trials"),
    script:
        "../scripts/import_trials.py"


rule decompose_scales:
    input:
        trials="results/data/{dataset}/trials.parquet",
    output:
        scales="results/data/{dataset}/scales.parquet",
    log:
        "results/logs/decompose_scales/{dataset}.log",
    params:
        wavelet=dump(SETTINGS.data.wavelet),
        code=digest("decompose_scales"),
    script:
        "../scripts/decompose_scales.py"


rule draw_trials:
    input:
        trials="results/data/{dataset}/trials.parquet",
        scales="results/data/{dataset}/scales.parquet",
    output:
        trials=report(
            "results/figures/{dataset}/trials.png",
            caption="../report/trials.rst",
            category="1 data",
            labels={"dataset": "{dataset}", "figure": "1 trials"},
        ),
        scales=report(
            "results/figures/{dataset}/scales.png",
            caption="../report/scales.rst",
            category="1 data",
            labels={"dataset": "{dataset}", "figure": "2 scales"},
        ),
    log:
        "results/logs/draw_trials/{dataset}.log",
    params:
        code=digest("draw_trials"),
    script:
        "../scripts/draw_trials.py"
