# Compare with the trials, see where the model fails, learn which effect is missing, add it, watch the error fall.
DIAGNOSIS = "results/diagnosis/{dataset}"
DIAGNOSIS_PICTURES = "results/figures/{dataset}/diagnosis"
DIAGNOSIS_TIME = "results/benchmarks/diagnose_dataset/{dataset}.tsv"
STUDY = SETTINGS.diagnosis.study
STUDIED = [*STUDY.effects, *("+".join(pair) for pair in STUDY.pairs), "none"]
DIAGNOSIS_TABLES = [
    "ladder", "ranking", "parameters", "correlations", "errors", "misfit", "missing_torque", "independence", "next_trials"
]  # as in myowave.diagnosis.report.tables.TABLES, which takes a second to load
DIAGNOSIS_FIGURES = [
    "overlay", "errors", "independence", "correlations", "misfit", "missing_torque", "ranking", "ladder", "parameters"
]


# A checkpoint, as it decides with which models networks are trained where targets.follow_verdict asks for that.
checkpoint diagnose_dataset:
    input:
        trials="results/data/{dataset}/trials.parquet",
        physics=SETTINGS.physics.files,
    output:
        summary=f"{DIAGNOSIS}/summary.json",
        tables=expand(f"{DIAGNOSIS}/{{table}}.csv", table=DIAGNOSIS_TABLES, allow_missing=True),
        predictions=f"{DIAGNOSIS}/predictions.parquet",
        draft=f"{DIAGNOSIS}/draft_effect.py",
    log:
        "results/logs/diagnose_dataset/{dataset}.log",
    benchmark:
        DIAGNOSIS_TIME
    threads: 1
    params:
        physics=section("physics"),
        identify=identify_section,
        models=lambda wildcards: models_of(wildcards.dataset),
        diagnosis=lambda wildcards: {k: v for k, v in section("diagnosis").items() if k != "study"},
        code=digest("diagnose_dataset"),
    script:
        "../scripts/diagnose_dataset.py"


rule score_verdict:
    input:
        summary=f"{DIAGNOSIS}/summary.json",
        truth=truth_of,
    output:
        verdict=f"{DIAGNOSIS}/verdict.json",
    log:
        "results/logs/score_verdict/{dataset}.log",
    params:
        run=dict(recipes=list(SETTINGS.targets.recipes), config_files=CONFIG_FILES),
        code=digest("score_verdict"),
    script:
        "../scripts/score_verdict.py"


# Reads the verdict with the truth, and no more of it; the pictures and the page show what that says.
rule watch_ladder:
    input:
        rungs=f"{DIAGNOSIS}/ladder.csv",
        parameters=f"{DIAGNOSIS}/parameters.csv",
        verdict=f"{DIAGNOSIS}/verdict.json",
        evaluations=networks_of,
    output:
        ladder=f"{DIAGNOSIS}/watch.csv",
        parameters=f"{DIAGNOSIS}/watch_parameters.csv",
    log:
        "results/logs/watch_ladder/{dataset}.log",
    params:
        beside=networks_beside,
        code=digest("watch_ladder"),
    script:
        "../scripts/watch_ladder.py"


rule draw_diagnosis:
    input:
        summary=f"{DIAGNOSIS}/summary.json",
        tables=expand(f"{DIAGNOSIS}/{{table}}.csv", table=DIAGNOSIS_TABLES, allow_missing=True),
        predictions=f"{DIAGNOSIS}/predictions.parquet",
        ladder=f"{DIAGNOSIS}/watch.csv",
        parameters=f"{DIAGNOSIS}/watch_parameters.csv",
    output:
        figures=[
            report(
                f"{DIAGNOSIS_PICTURES}/{figure}.png",
                caption=f"../report/diagnosis/{figure}.rst",
                category="3 diagnosis",
                subcategory="{dataset}",
                labels={"dataset": "{dataset}", "figure": f"{place} {figure}"},
            )
            for place, figure in enumerate(DIAGNOSIS_FIGURES, 1)
        ],
    log:
        "results/logs/draw_diagnosis/{dataset}.log",
    params:
        code=digest("draw_diagnosis"),
    script:
        "../scripts/draw_diagnosis.py"


rule tell_verdict:
    input:
        verdict=f"{DIAGNOSIS}/verdict.json",
        ladder=f"{DIAGNOSIS}/watch.csv",
        parameters=f"{DIAGNOSIS}/watch_parameters.csv",
        ranking=f"{DIAGNOSIS}/ranking.csv",
        proposals=f"{DIAGNOSIS}/next_trials.csv",
        draft=f"{DIAGNOSIS}/draft_effect.py",
        figures=rules.draw_diagnosis.output.figures,
        template=Path(workflow.basedir) / "workflow/report/verdict.html.j2",
    output:
        page=report(
            f"{DIAGNOSIS}/verdict.html",
            caption="../report/verdict.rst",
            category="3 diagnosis",
            subcategory="{dataset}",
            labels={"dataset": "{dataset}", "figure": "0 verdict"},
        ),
    log:
        "results/logs/tell_verdict/{dataset}.log",
    params:
        code=digest("tell_verdict"),
    script:
        "../scripts/tell_verdict.py"


rule simulate_study:
    output:
        trials=expand(
            "results/diagnosis/study/trials-{seed}.parquet", seed=range(1, max(STUDY.seeds, STUDY.clean_sets) + 1)
        ),
    log:
        "results/logs/simulate_study.log",
    params:
        physics=section("physics"),
        dataset=dump(DATASETS[STUDY.dataset]),
        code=digest("simulate_study"),
    script:
        "../scripts/simulate_study.py"


rule study_effect:
    input:
        trials=rules.simulate_study.output.trials,
        physics=SETTINGS.physics.files,
    output:
        cases="results/diagnosis/study/{hidden}.csv",
    log:
        "results/logs/study_effect/{hidden}.log",
    wildcard_constraints:
        hidden=one_of(name.replace("+", r"\+") for name in STUDIED),
    threads: 1
    params:
        physics=section("physics"),
        dataset=dump(DATASETS[STUDY.dataset]),
        diagnosis=section("diagnosis"),
        code=digest("study_effect"),
    script:
        "../scripts/study_effect.py"


rule summarize_study:
    input:
        cases=expand("results/diagnosis/study/{hidden}.csv", hidden=STUDIED),
    output:
        cases="results/diagnosis/study.csv",
        confusion="results/diagnosis/study_confusion.csv",
        summary="results/diagnosis/study_summary.json",
    log:
        "results/logs/summarize_study.log",
    params:
        code=digest("summarize_study"),
    script:
        "../scripts/summarize_study.py"


rule draw_study:
    input:
        cases=rules.summarize_study.output.cases,
        summary=rules.summarize_study.output.summary,
    output:
        figure=report("results/figures/study.png", caption="../report/study.rst", category="3 diagnosis"),
    log:
        "results/logs/draw_study.log",
    params:
        code=digest("draw_study"),
    script:
        "../scripts/draw_study.py"


rule hidden_effects:
    input:
        rules.summarize_study.output,
        rules.draw_study.output,
