# How often the diagnosis is right: effects hidden in simulated trials, `snakemake hidden_effects --cores 2`.
from myowave.settings import shipped_effects

STUDY = SETTINGS.diagnosis.study
STUDIED = [*(STUDY.effects or shipped_effects()), *("+".join(pair) for pair in STUDY.pairs), "none"]


def study_section():
    """Settings of the diagnosis without the lists of what is hidden, so that a further effect reruns no other."""
    diagnosis = section("diagnosis")
    return diagnosis | {"study": {k: v for k, v in diagnosis["study"].items() if k not in ("effects", "pairs")}}


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


rule simulate_study:
    input:
        physics=study_files,
    output:
        trials=expand(
            "results/diagnosis/study/trials-{seed}.parquet", seed=range(1, max(STUDY.seeds, STUDY.clean_sets) + 1)
        ),
    log:
        "results/logs/simulate_study.log",
    params:
        physics=study_physics,
        contents=study_contents,
        dataset=study_dataset,
        code=digest("simulate_study"),
    script:
        "../scripts/simulate_study.py"


rule study_effect:
    input:
        trials=rules.simulate_study.output.trials,
        physics=study_files,
    output:
        cases="results/diagnosis/study/{hidden}.csv",
    log:
        "results/logs/study_effect/{hidden}.log",
    wildcard_constraints:
        hidden=one_of(name.replace("+", r"\+") for name in STUDIED),
    threads: 1
    params:
        physics=study_physics,
        contents=study_contents,
        dataset=study_dataset,
        diagnosis=study_section(),
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
