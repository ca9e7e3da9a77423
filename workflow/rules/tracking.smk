# MLflow shows what is in results/. It can be rebuilt from there at any time, and nothing depends on it.


rule publish_runs:
    input:
        evaluations=evaluations,
        figures=figures_of_learning,
        verdicts=verdicts,
    output:
        note="results/tracking/published.md",
    log:
        "results/logs/publish_runs.log",
    params:
        tracking=section("tracking"),
        recipes={name: dump(SETTINGS.learning.recipes[name]) for name in SETTINGS.targets.recipes},
        models=published_models,
        diagnoses=published_diagnoses(),
        sweeps=[],
    script:
        "../scripts/publish_runs.py"


# Asked for by name it always runs, having no output: the way to rebuild a store that was moved or deleted.
rule publish:
    input:
        **rules.publish_runs.input,
    log:
        "results/logs/publish.log",
    params:
        **{**rules.publish_runs.params, "sweeps": published_sweeps("results/learning/*/*/*/*-scale/sweep")},
    script:
        "../scripts/publish_runs.py"
