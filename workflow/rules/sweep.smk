# A search for better settings of a recipe: `snakemake sweep --cores 2`. The search itself, a journal file, is no output of
# any rule: Snakemake deletes outputs before a job, and a search is to be continued.
SWEEP = SETTINGS.learning.sweep
SWEEP_PHYSICS = SETTINGS.physics_of(SWEEP.dataset)
SWEPT = NETWORK.format(**dump(SWEEP))
SWEEP_FOLDER = f"results/learning/{SWEPT}/sweep"
JOURNAL = f"{SWEEP_FOLDER}/journal.log"


def sweep_section(*left_out):
    """Settings of the sweep without those that a rule does not depend on."""
    return {key: value for key, value in dump(SWEEP).items() if key not in left_out}


def sweep_labels(figure):
    return {"dataset": SWEEP.dataset, "model": SWEEP.model, "recipe": SWEEP.recipe, "figure": figure}


# All that an error on held-out data depends on; a search is continued as long as it stays the same.
judged_section = dict(
    physics=dump(SWEEP_PHYSICS),
    contents=digest_files(SWEEP_PHYSICS.files),
    identify=public(DATASETS[SWEEP.dataset])["identify"],
    recipe=dump(SETTINGS.learning.recipes[SWEEP.recipe]),
    code=[digest_script(PACKAGE / f"learning/{name}.py") for name in ("from_settings", "sweep/objective")],
)


localrules:
    sweep,


rule sweep:
    input:
        f"{SWEEP_FOLDER}/best.yaml",
        f"{SWEEP_FOLDER}/test_scores.csv",


rule prepare_sweep:
    input:
        trials=f"results/data/{SWEEP.dataset}/trials.parquet",
    output:
        scales=f"{SWEEP_FOLDER}/scales.parquet",
        search=f"{SWEEP_FOLDER}/search.txt",
    log:
        f"results/logs/prepare_sweep/{SWEPT}.log",
    params:
        sweep=sweep_section("trials", "workers"),
        wavelet=dump(SETTINGS.data.wavelet),
        journal=JOURNAL,
        judged=judged_section,
        code=digest("prepare_sweep"),
    script:
        "../scripts/prepare_sweep.py"


rule search_settings:
    input:
        scales=f"{SWEEP_FOLDER}/scales.parquet",
        search=f"{SWEEP_FOLDER}/search.txt",
        physics=SWEEP_PHYSICS.files,
    output:
        done=f"{SWEEP_FOLDER}/worker-{{worker}}.txt",
    log:
        f"results/logs/search_settings/{SWEPT}/worker-{{worker}}.log",
    wildcard_constraints:
        worker=r"\d+",
    threads: 1
    params:
        sweep=sweep_section(),
        journal=JOURNAL,
        judged=judged_section,
        code=digest("search_settings"),  # a search that is full stays as it is
    script:
        "../scripts/search_settings.py"


rule summarize_sweep:
    input:
        search=f"{SWEEP_FOLDER}/search.txt",
        workers=expand(f"{SWEEP_FOLDER}/worker-{{worker}}.txt", worker=range(SWEEP.workers)),
    output:
        trials=f"{SWEEP_FOLDER}/trials.csv",
        best=f"{SWEEP_FOLDER}/best.yaml",
        summary=f"{SWEEP_FOLDER}/summary.md",
        figures=[
            report(
                f"results/figures/{SWEPT}/sweep/{figure}.png",
                caption="../report/sweep.rst",
                category="2 learning",
                labels=sweep_labels(f"{place} sweep {figure}"),
            )
            for place, figure in enumerate(("history", "importance", "slices", "contours"), 4)
        ],
    log:
        f"results/logs/summarize_sweep/{SWEPT}.log",
    params:
        sweep=sweep_section("workers"),
        journal=JOURNAL,
        recipe=judged_section["recipe"],
        code=digest("summarize_sweep"),
    script:
        "../scripts/summarize_sweep.py"


# The test trial is looked at here, once, after the search.
rule score_sweep:
    input:
        best=f"{SWEEP_FOLDER}/best.yaml",
        default=f"results/learning/{SWEPT}/evaluation.csv",
        trials=f"results/data/{SWEEP.dataset}/trials.parquet",
        scales=f"results/data/{SWEEP.dataset}/scales.parquet",
        truth=truth_of(SWEEP.dataset),
        physics=SWEEP_PHYSICS.files,
    output:
        scores=report(
            f"{SWEEP_FOLDER}/test_scores.csv",
            caption="../report/test_scores.rst",
            category="2 learning",
            labels=sweep_labels("8 sweep test scores"),
        ),
    log:
        f"results/logs/score_sweep/{SWEPT}.log",
    threads: 1
    params:
        sweep=sweep_section("workers", "trials"),
        seeds=SETTINGS.learning.seeds,
        wavelet=dump(SETTINGS.data.wavelet),
        judged=judged_section,
        code=digest("score_sweep"),
    script:
        "../scripts/score_sweep.py"
