# Compare with the trials, see where the model fails, learn which effect is missing, add it, watch the error fall.
import os

from myowave.diagnosis.report.contents import FIGURE_NAMES, COMPARISON_NAMES, TABLE_NAMES

DIAGNOSIS = "results/diagnosis/{dataset}"
DIAGNOSIS_PICTURES = "results/figures/{dataset}/diagnosis"
DIAGNOSIS_TABLES = expand(f"{DIAGNOSIS}/{{table}}.csv", table=TABLE_NAMES, allow_missing=True)
# What stands inside the pages.
PAGE_PARTS = (
    "verdict.html.j2",
    "page.html.j2",
    "tables.html.j2",
    "sentences.j2",
    "words.j2",
    "style.css",
    "print.js",
    "motion.js",
    "uplot/uPlot.iife.min.js",
    "uplot/uPlot.min.css",
    "uplot/LICENSE",
)
COMPARISON_TABLES = expand(f"{DIAGNOSIS}/{{table}}.csv", table=COMPARISON_NAMES, allow_missing=True)


# The files after --configfile, relative to this folder.
CONFIG_FILES = [os.path.relpath(path) for path in workflow.overwrite_configfiles]


def page_file(name):
    """A file of the pages; its name is the same after a move."""
    return os.path.relpath(ROOT / "workflow/report" / name)


# A checkpoint, as it decides with which models networks are trained where targets.follow_verdict asks for that.
checkpoint diagnose_dataset:
    input:
        trials="results/data/{dataset}/trials.parquet",
        physics=physics_files,
        draft=page_file("draft_effect.py.j2"),
    output:
        summary=f"{DIAGNOSIS}/summary.json",
        tables=DIAGNOSIS_TABLES,
        predictions=f"{DIAGNOSIS}/predictions.parquet",
        draft=f"{DIAGNOSIS}/draft_effect.py",
    log:
        "results/logs/diagnose_dataset/{dataset}.log",
    benchmark:
        "results/benchmarks/diagnose_dataset/{dataset}.tsv"
    threads: 1
    params:
        physics=physics_section,
        contents=physics_contents,
        identify=identify_section,
        models=lambda wildcards: models_of(wildcards.dataset),
        diagnosis=lambda wildcards: dump(SETTINGS.diagnosis_of(wildcards.dataset)),
        code=digest("diagnose_dataset"),
    script:
        "../scripts/diagnose_dataset.py"


# The same fits, asked for torque and for short horizons, where nothing diverges.
rule compare_models:
    input:
        trials="results/data/{dataset}/trials.parquet",
        physics=physics_files,
        parameters=f"{DIAGNOSIS}/parameters.csv",
        errors=f"{DIAGNOSIS}/errors.csv",
    output:
        tables=COMPARISON_TABLES,
    log:
        "results/logs/compare_models/{dataset}.log",
    params:
        physics=physics_section,
        contents=physics_contents,
        code=digest("compare_models"),
    script:
        "../scripts/compare_models.py"


rule score_verdict:
    input:
        summary=f"{DIAGNOSIS}/summary.json",
        torque=f"{DIAGNOSIS}/torque.csv",
        horizons=f"{DIAGNOSIS}/horizons.csv",
        truth=lambda wildcards: truth_of(wildcards.dataset),
    output:
        verdict=f"{DIAGNOSIS}/verdict.json",
    log:
        "results/logs/score_verdict/{dataset}.log",
    params:
        run=lambda wildcards: dict(
            recipes=list(SETTINGS.targets.recipes_of(wildcards.dataset)), config_files=CONFIG_FILES
        ),
        code=digest("score_verdict"),
    script:
        "../scripts/score_verdict.py"


# Reads the verdict with the truth, and no more of it; the pictures and the page show what that says.
rule watch_ladder:
    input:
        rungs=f"{DIAGNOSIS}/ladder.csv",
        verdict=f"{DIAGNOSIS}/verdict.json",
        evaluations=lambda wildcards: networks_of(wildcards.dataset),
        baselines=lambda wildcards: (
            baselines(wildcards.dataset) if wildcards.dataset in SETTINGS.targets.datasets else []
        ),
    output:
        ladder=f"{DIAGNOSIS}/watch.csv",
        parameters=f"{DIAGNOSIS}/watch_parameters.csv",
    log:
        "results/logs/watch_ladder/{dataset}.log",
    params:
        # Baselines, which leave no checkpoint, hold no model.
        beside=lambda wildcards: [
            path for path in networks_beside(wildcards.dataset) if Path(path).with_name("scale-0.pt").exists()
        ],
        beside_contents=lambda wildcards: digest_files(networks_beside(wildcards.dataset)),
        seeds=SETTINGS.learning.seeds,
        code=digest("watch_ladder"),
    script:
        "../scripts/watch_ladder.py"


rule draw_diagnosis:
    input:
        verdict=f"{DIAGNOSIS}/verdict.json",
        tables=DIAGNOSIS_TABLES,
        comparison=COMPARISON_TABLES,
        predictions=f"{DIAGNOSIS}/predictions.parquet",
        ladder=f"{DIAGNOSIS}/watch.csv",
        ranking=f"{DIAGNOSIS}/ranking.csv",
    output:
        figures=[
            report(
                f"{DIAGNOSIS_PICTURES}/{figure}.png",
                caption=f"../report/diagnosis/{figure}.rst",
                category="3 diagnosis",
                subcategory="{dataset}",
                labels={"dataset": "{dataset}", "figure": f"{place:02} {figure}"},
            )
            for place, figure in enumerate(FIGURE_NAMES, 1)
        ],
    log:
        "results/logs/draw_diagnosis/{dataset}.log",
    params:
        code=digest("draw_diagnosis"),
    script:
        "../scripts/draw_diagnosis.py"


def quality_of(wildcards):
    """What is doubtful in the recordings of a dataset; nothing was recorded of a simulated one."""
    return [] if wildcards.dataset in SIMULATED else f"results/data/{wildcards.dataset}/quality.json"


rule tell_verdict:
    input:
        verdict=f"{DIAGNOSIS}/verdict.json",
        ladder=f"{DIAGNOSIS}/watch.csv",
        parameters=f"{DIAGNOSIS}/watch_parameters.csv",
        ranking=f"{DIAGNOSIS}/ranking.csv",
        predictions=f"{DIAGNOSIS}/predictions.parquet",
        draft=f"{DIAGNOSIS}/draft_effect.py",
        quality=quality_of,
        figures=rules.draw_diagnosis.output.figures,
        parts=[page_file(name) for name in PAGE_PARTS],
    output:
        page=report(
            f"{DIAGNOSIS}/verdict.html",
            caption="../report/verdict.rst",
            category="3 diagnosis",
            subcategory="{dataset}",
            labels={"dataset": "{dataset}", "figure": "00 verdict"},
        ),
    log:
        "results/logs/tell_verdict/{dataset}.log",
    params:
        code=digest("tell_verdict"),
    script:
        "../scripts/tell_verdict.py"


def verdicts_beside(wildcards):
    """Settings of each dataset that other runs diagnosed, as far as this one knows them: its row stays in the index."""
    pages = sorted(Path().glob(f"{DIAGNOSIS.format(dataset='*')}/verdict.html"))
    names = [page.parent.name for page in pages if page.parent.name not in SETTINGS.targets.diagnosed]
    return {name: public(DATASETS[name]) if name in DATASETS else {} for name in names}


def links_of_all(wildcards):
    """(text, address) of what belongs to all datasets, seen from results/."""
    trained = SETTINGS.targets.datasets or Path("results/summary.csv").exists()
    tables = [("One row for each trained network: summary.csv", "summary.csv")] if trained else []
    grouped = [name for name in SETTINGS.targets.diagnosed if DATASETS[name].changed]
    tables += [(f"What changed between two groups of trials of {n}", f"diagnosis/{n}/changed.html") for n in grouped]
    files = [("config.yaml", os.path.relpath(ROOT / "config.yaml")), *zip(CONFIG_FILES, CONFIG_FILES)]
    settings = {os.path.normpath(path): f"Settings: {name}" for name, path in reversed(files)}
    return tables + [(text, os.path.join("..", path)) for path, text in reversed(settings.items())]


# The first page to open: links to all that the main job made.
rule list_datasets:
    input:
        verdicts=expand(f"{DIAGNOSIS}/verdict.json", dataset=SETTINGS.targets.diagnosed),
        ladders=expand(f"{DIAGNOSIS}/watch.csv", dataset=SETTINGS.targets.diagnosed),
        pictures=expand(f"{DIAGNOSIS_PICTURES}/glance.png", dataset=SETTINGS.targets.diagnosed),
        parts=[page_file(name) for name in ("index.html.j2", "page.html.j2", "sentences.j2", "words.j2", "style.css")],
    output:
        index="results/index.html",
    log:
        "results/logs/list_datasets.log",
    params:
        settings={name: public(DATASETS[name]) for name in SETTINGS.targets.diagnosed},
        beside=verdicts_beside,
        links=links_of_all,
        code=digest("list_datasets"),
    script:
        "../scripts/list_datasets.py"


# What changed between two groups of trials, where a dataset asks that.
rule tell_change:
    input:
        trials="results/data/{dataset}/trials.parquet",
        physics=physics_files,
        parts=[
            page_file(name)
            for name in ("changed.html.j2", "page.html.j2", "tables.html.j2", "changed.j2", "words.j2", "style.css")
        ],
    output:
        facts=f"{DIAGNOSIS}/changed.json",
        page=report(
            f"{DIAGNOSIS}/changed.html",
            caption="../report/changed.rst",
            category="3 diagnosis",
            subcategory="{dataset}",
            labels={"dataset": "{dataset}", "figure": "what changed"},
        ),
    log:
        "results/logs/tell_change/{dataset}.log",
    threads: 4  # as SIDE_BY_SIDE of `myowave changed`
    params:
        physics=physics_section,
        contents=physics_contents,
        changed=lambda wildcards: public(DATASETS[wildcards.dataset])["changed"],
        scatter=lambda wildcards: dump(SETTINGS.diagnosis_of(wildcards.dataset))["scatter"],
        code=digest("tell_change"),
    script:
        "../scripts/tell_change.py"
