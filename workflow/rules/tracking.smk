# MLflow shows what is in results/. It can be rebuilt from there at any time, and nothing depends on it.


def published_diagnoses():
    """(folder of the results, folder of the pictures, time it took) of every diagnosis that MLflow shows."""
    return [diagnosis_paths(dataset) for dataset in SETTINGS.targets.diagnosed]


def diagnosis_paths(dataset):
    return [part.format(dataset=dataset) for part in (DIAGNOSIS, DIAGNOSIS_PICTURES, DIAGNOSIS_TIME)]


def published_models(wildcards, input):
    """(evaluation, figures) of every trained model that MLflow shows; what follows a verdict has no figures."""
    drawn = set(input.figures)
    return [
        (path, [figure for figure in figures_of("/".join(Path(path).parts[2:5])) if figure in drawn])
        for path in input.evaluations
    ]


def finished_models(wildcards):
    """(evaluation, figures) of every trained model in results/ whose recipe is in the configuration."""
    evaluations = sorted(Path().glob("results/learning/*/*/*/*-scale/evaluation.csv"))
    return [
        (str(path), [figure for figure in figures_of("/".join(path.parts[2:5])) if Path(figure).exists()])
        for path in evaluations
        if path.parts[4] in SETTINGS.learning.recipes
    ]


def finished_diagnoses(wildcards):
    """As `published_diagnoses`, of every verdict in results/."""
    pages = sorted(Path().glob(f"{DIAGNOSIS.format(dataset='*')}/verdict.html"))
    return [diagnosis_paths(path.parent.name) for path in pages]


def finished_sweeps(wildcards):
    """(folder, figures) of every sweep in results/ that was scored."""
    folders = [path.parent for path in sorted(Path().glob("results/learning/*/*/*/*-scale/sweep/test_scores.csv"))]
    return [(str(folder), sweep_figures("/".join(folder.parts[2:6]))) for folder in folders]


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
        recipes={name: dump(SETTINGS.learning.recipes[name]) for name in SETTINGS.targets.trained},
        models=published_models,
        diagnoses=published_diagnoses(),
        sweeps=[],
    script:
        "../scripts/publish_runs.py"


# The way to rebuild a store that was moved or deleted, from what is in results/. Having no output it always runs when
# asked for, and having no input it makes nothing else, also where results are older than the code.
rule publish:
    log:
        "results/logs/publish.log",
    params:
        tracking=section("tracking"),
        recipes=section("learning")["recipes"],
        models=finished_models,
        diagnoses=finished_diagnoses,
        sweeps=finished_sweeps,
    script:
        "../scripts/publish_runs.py"
