# Trials, simulated, measured or recorded, become one table; after it nobody asks which they were.
from myowave.data.files import all_files


def recordings(wildcards):
    """Files of a dataset that was measured or recorded; a pattern stands for the files it matches now."""
    try:
        dataset = DATASETS[wildcards.dataset]
        key = "files" if dataset.kind == "measured" else "trials"  # whose signals name files by them
        return list(map(str, all_files(f"data.datasets.{wildcards.dataset}.{key}", dataset.files)))
    except ValueError as error:
        sys.exit(str(error))


def table_section(wildcards):
    """Tables of path lengths of the dataset's arm, by muscle: all that bounds its angles."""
    return {muscle: dump(path) for muscle, path in SETTINGS.physics_of(wildcards.dataset).tables.items()}


def table_files(wildcards):
    """Files of these tables."""
    return SETTINGS.physics_of(wildcards.dataset).table_files


def contents(wildcards):
    """Digests of the recordings and of these tables: dates alone miss a file put back."""
    return digest_files([*recordings(wildcards), *table_files(wildcards)])


rule simulate_trials:
    input:
        physics=physics_files,
    output:
        trials="results/data/{dataset}/trials.parquet",
        truth="results/data/{dataset}/truth.json",
    log:
        "results/logs/simulate_trials/{dataset}.log",
    wildcard_constraints:
        dataset=one_of(SIMULATED),
    params:
        physics=physics_section,
        contents=physics_contents,
        dataset=lambda wildcards: dataset_section(wildcards, dump),  # with what is hidden: this rule puts it in
        code=digest("simulate_trials"),
    script:
        "../scripts/simulate_trials.py"


rule import_trials:
    input:
        recordings=recordings,  # so that a changed file is imported again
        tables=table_files,
    output:
        trials="results/data/{dataset}/trials.parquet",
        quality="results/data/{dataset}/quality.json",
    log:
        "results/logs/import_trials/{dataset}.log",
    wildcard_constraints:
        dataset=one_of([name for name in DATASETS if name not in SIMULATED]),
    params:
        dataset=dataset_section,
        contents=contents,
        channels=lambda wildcards: SETTINGS.physics_of(wildcards.dataset).sides,
        tables=table_section,
        code=digest("import_trials"),
    script:
        "../scripts/import_trials.py"


# Raw EMG, envelope and angle of each trial with what was found in them: `snakemake results/figures/DATASET/recording`.
rule draw_recording:
    input:
        recordings=recordings,
        quality="results/data/{dataset}/quality.json",
    output:
        pictures=report(
            directory("results/figures/{dataset}/recording"),
            patterns=["{trial}.png"],
            caption="../report/recording.rst",
            category="1 data",
            labels={"dataset": "{dataset}", "figure": "0 recording of {trial}"},
        ),
    log:
        "results/logs/draw_recording/{dataset}.log",
    wildcard_constraints:
        dataset=one_of(RECORDED),
    params:
        dataset=dataset_section,
        contents=contents,
        code=digest("draw_recording"),
    script:
        "../scripts/draw_recording.py"


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
