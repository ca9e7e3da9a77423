# How often the diagnosis is right: effects hidden in simulated trials of several worlds, `snakemake hidden_effects`. Its
# table stands in docs/.
from myowave.settings import WORLDS

STUDY = SETTINGS.diagnosis.study


def studied_dataset():
    """The simulated dataset that effects are hidden in."""
    if SETTINGS.studied is None:
        sys.exit(
            "hidden_effects hides effects in simulated trials, and data.datasets has none with kind: simulated. Copy case1 "
            "from the config.yaml that ships, or lay your files over that: --configfile config.yaml mine.yaml."
        )
    return SETTINGS.studied


def study_files(wildcards):
    """Files that the physics of that dataset is made of."""
    return SETTINGS.physics_of(studied_dataset()).files


def study_contents(wildcards):
    """Digests of these files."""
    return digest_files(study_files(wildcards))


def study_physics(wildcards):
    return dump(SETTINGS.physics_of(studied_dataset()))


def study_dataset(wildcards):
    return dump(DATASETS[studied_dataset()])


rule study_world:
    input:
        physics=study_files,
    output:
        cases="results/diagnosis/study/{world}-{part}.csv",
    log:
        "results/logs/study_world/{world}-{part}.log",
    wildcard_constraints:
        world=one_of(WORLDS),
        part=r"\d+",
    threads: 1
    params:
        physics=study_physics,
        contents=study_contents,
        dataset=study_dataset,
        diagnosis=section("diagnosis"),
        code=digest("study_world"),
    script:
        "../scripts/study_world.py"


rule summarize_study:
    input:
        cases=expand("results/diagnosis/study/{world}-{part}.csv", world=WORLDS, part=range(STUDY.parts)),
    output:
        cases="results/diagnosis/study.csv",
        summary="results/diagnosis/study_summary.csv",
        page="docs/study.md",
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
