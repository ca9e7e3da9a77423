# The network is trained from the coarsest scale to the finest; each scale starts where the last one stopped.


def coarser_checkpoint(wildcards):
    """The checkpoint that a scale starts from; none at the coarsest."""
    coarser = int(wildcards.level) + 1
    if coarser >= int(wildcards.scales):
        return []
    return f"results/learning/{NETWORK}/scale-{coarser}.pt".format(**wildcards)


rule train_scale:
    input:
        scales="results/data/{dataset}/scales.parquet",
        coarser=coarser_checkpoint,
        physics=physics_files,
    output:
        # Those of before stay where training anew fails.
        checkpoint=update(f"results/learning/{NETWORK}/scale-{{level}}.pt"),
        history=update(f"results/learning/{NETWORK}/history-{{level}}.parquet"),
    log:
        f"results/logs/train_scale/{NETWORK}/scale-{{level}}.log",
    benchmark:
        f"results/benchmarks/train_scale/{NETWORK}/scale-{{level}}.tsv"
    threads: 1
    params:
        physics=physics_section,
        contents=physics_contents,
        identify=identify_section,
        recipe=lambda wildcards: dump(SETTINGS.learning.recipes[wildcards.recipe]),
        wavelet=dump(SETTINGS.data.wavelet),
        seeds=SETTINGS.learning.seeds,
        code=digest("train_scale"),
    script:
        "../scripts/train_scale.py"


rule evaluate_model:
    input:
        trials="results/data/{dataset}/trials.parquet",
        truth=lambda wildcards: truth_of(wildcards.dataset),
        checkpoint=f"results/learning/{NETWORK}/scale-0.pt",
    output:
        evaluation=f"results/learning/{NETWORK}/evaluation.csv",
        parameters=f"results/learning/{NETWORK}/parameters.csv",
        predictions=f"results/learning/{NETWORK}/predictions.parquet",
    log:
        f"results/logs/evaluate_model/{NETWORK}.log",
    params:
        code=digest("evaluate_model"),
    script:
        "../scripts/evaluate_model.py"


if SETTINGS.learning.baselines:

    # What an engineer would try first: same trials, same scores, in every table.
    rule score_baselines:
        input:
            trials="results/data/{dataset}/trials.parquet",
            physics=physics_files,
        output:
            baselines(),
        log:
            "results/logs/score_baselines/{dataset}.log",
        benchmark:
            "results/benchmarks/score_baselines/{dataset}.tsv"
        threads: 1
        params:
            baselines={name: dump(of) for name, of in SETTINGS.learning.baselines.items()},
            physics=physics_section,
            contents=physics_contents,
            seeds=SETTINGS.learning.seeds,
            code=digest("score_baselines"),
        script:
            "../scripts/score_baselines.py"


# Rows of networks that runs with other settings trained stay: what they made is in results/ as well.
rule summarize_models:
    input:
        evaluations=evaluations,
    output:
        summary=report(
            "results/summary.csv",
            caption="../report/summary.rst",
            category="2 learning",
            labels={"dataset": "all", "model": "all", "recipe": "all", "figure": "0 summary table"},
        ),
    log:
        "results/logs/summarize_models.log",
    params:
        beside=lambda wildcards: networks_beside(),
        beside_contents=lambda wildcards: digest_files(networks_beside()),
        seeds=SETTINGS.learning.seeds,
        code=digest("summarize_models"),
    script:
        "../scripts/summarize_models.py"


# Whether more scales help, of all that was trained: a reader is not shown the ones that gained alone.
rule judge_scales:
    input:
        summary="results/summary.csv",
    output:
        scales=report(
            "results/scales.csv",
            caption="../report/more_scales.rst",
            category="2 learning",
            labels={"dataset": "all", "model": "all", "recipe": "all", "figure": "0 do more scales help"},
        ),
    log:
        "results/logs/judge_scales.log",
    params:
        code=digest("judge_scales"),
    script:
        "../scripts/judge_scales.py"


def of_scales(pattern):
    """An input function: the pattern for every number of scales of a recipe, and every level."""
    numbers = [(scales, level) for scales in TARGETS.scales for level in range(scales)]
    return lambda wildcards: sorted(
        {pattern.format(**wildcards, scales=scales, level=level) for scales, level in numbers}
    )


rule draw_models:
    input:
        evaluations=of_scales(f"results/learning/{NETWORK}/evaluation.csv"),
        baselines=lambda wildcards: baselines(wildcards.dataset),
        predictions=of_scales(f"results/learning/{NETWORK}/predictions.parquet"),
        histories=of_scales(f"results/learning/{NETWORK}/history-{{level}}.parquet"),
    output:
        figures=[
            report(
                f"results/figures/{RUNS}/{figure}.png",
                caption=f"../report/{figure}.rst",
                category="2 learning",
                labels={
                    "dataset": "{dataset}",
                    "model": "{model}",
                    "recipe": "{recipe}",
                    "figure": f"{place} {figure}",
                },
            )
            for place, figure in enumerate(LEARNING_PICTURES, 1)
        ],
    log:
        f"results/logs/draw_models/{RUNS}.log",
    params:
        identify=identify_section,
        code=digest("draw_models"),
    script:
        "../scripts/draw_models.py"
