# MLflow shows what is in results/. It can be rebuilt from there at any time, and nothing depends on it.


def published(recipes):
    """Settings by name of these recipes and of the baselines."""
    learning = dump(SETTINGS.learning)
    return {name: learning["recipes"][name] for name in recipes} | learning["baselines"]


rule publish_runs:
    input:
        evaluations=evaluations,
        figures=[FIGURES_OF_DATA, FIGURES_OF_LEARNING],
        verdicts=VERDICTS,
    output:
        note="results/tracking/published.md",
    log:
        "results/logs/publish_runs.log",
    params:
        tracking=dump(SETTINGS.tracking),
        recipes=published(SETTINGS.targets.trained),
        code=digest("publish_runs"),
    script:
        "../scripts/publish_runs.py"


# The way to rebuild a store that was moved or deleted, from what is in results/. Having no output it always runs when
# asked for, and having no input it makes nothing else, also where results are older than the code.
rule publish:
    log:
        "results/logs/publish.log",
    params:
        tracking=dump(SETTINGS.tracking),
        recipes=published(SETTINGS.learning.recipes),
    script:
        "../scripts/publish_runs.py"
