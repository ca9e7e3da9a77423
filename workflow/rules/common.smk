# The configuration, checked; and what the rules are given of it and of the code.
import json
import os
import sys
from glob import glob
from types import SimpleNamespace

from snakemake.exceptions import WorkflowError

from myowave.workflow.digest import digest_module, digest_script
from myowave.settings import SimulatedDataset, check_effects, dump, parse_settings, public
from myowave.settings.subjects import add_subjects, read_subjects

try:
    SETTINGS = parse_settings(add_subjects(config))
    check_effects(SETTINGS)
except ValueError as error:
    sys.exit(f"The configuration has problems; nothing was run.\n{error}\n`myowave settings` lists all keys.")

# What this run was given after --configfile, as one would type it here.
CONFIG_FILES = [os.path.relpath(path) for path in workflow.overwrite_configfiles]

# Jobs see their rule's params, not the configuration: it may hold what is hidden in a dataset.
config.clear()

DATASETS = SETTINGS.data.datasets
SUBJECTS = list(read_subjects(Path(SETTINGS.data.subjects))) if SETTINGS.data.subjects else []
SIMULATED = [name for name, dataset in DATASETS.items() if isinstance(dataset, SimulatedDataset)]
MEASURED = [name for name in DATASETS if name not in SIMULATED]

RUNS = "{dataset}/{model}/{recipe}"
LADDER = f"{RUNS}/{{scales}}-scale"


wildcard_constraints:
    dataset="|".join(DATASETS),
    model=r"base(\+[A-Za-z_]\w*)*",
    recipe="|".join(SETTINGS.learning.recipes),
    scales=r"[1-5]",
    level=r"[0-4]",


def one_of(names):
    """A wildcard constraint: one of these names, and nothing where there are none."""
    return "|".join(names) or "$^"


def digest(script):
    """Digest of a rule's script and of all the code that it uses, for `params`."""
    return digest_script(Path(workflow.basedir) / "workflow/scripts" / f"{script}.py")


def section(name):
    """A section of the configuration as plain data, for `params`."""
    return dump(getattr(SETTINGS, name))


def dataset_section(wildcards):
    """The dataset's settings without what is hidden in it."""
    return public(DATASETS[wildcards.dataset])


def recipe_section(wildcards):
    return dump(SETTINGS.learning.recipes[wildcards.recipe])


def models_of(dataset):
    return SETTINGS.targets.models.get(dataset, ("base",))


# ---- data


def recordings(wildcards):
    """Files of a measured dataset; a pattern stands for the files it matches now."""
    return expand_patterns(DATASETS[wildcards.dataset].files, f"data.datasets.{wildcards.dataset}.files")


def figures_of_data(wildcards):
    return expand(
        "results/figures/{dataset}/{figure}.png", dataset=SETTINGS.targets.datasets, figure=["trials", "scales"]
    )


def expand_patterns(patterns, key):
    """Files that the patterns match, each pattern's in order.

    Raises:
        WorkflowError: for a pattern that matches nothing.
    """
    files = []
    for pattern in patterns:
        matched = sorted(glob(pattern, recursive=True))
        if not matched:
            raise WorkflowError(
                f"{key}: {pattern!r} matches no file, looked up from {Path.cwd()}. Correct the name, or run snakemake "
                "from the folder that the name starts from."
            )
        files += matched
    return list(dict.fromkeys(files))


# ---- learning


def coarser_checkpoint(wildcards):
    """The checkpoint that a scale starts from; none at the coarsest."""
    coarser = int(wildcards.level) + 1
    if coarser >= int(wildcards.scales):
        return []
    return f"results/learning/{LADDER}/scale-{coarser}.pt".format(**wildcards)


def identify_section(wildcards):
    """The physical constants to identify, and where they start."""
    return dataset_section(wildcards)["identify"]


def truth_of(wildcards):
    """The truth to score against, where there is one."""
    return f"results/data/{wildcards.dataset}/truth.json" if wildcards.dataset in SIMULATED else []


def for_targets(pattern, datasets=SETTINGS.targets.datasets):
    """The pattern for every dataset with the models, recipes and numbers of scales that the targets name."""
    targets = SETTINGS.targets
    return [
        path
        for dataset in datasets
        for path in expand(
            pattern, dataset=dataset, model=models_of(dataset), recipe=targets.recipes, scales=targets.scales
        )
    ]


def figures_of(runs):
    """Figures of one dataset, model and recipe; `runs` may hold wildcards."""
    return [f"results/figures/{runs}/{figure}.png" for figure in ("metrics", "predictions", "parameters")]


def figures_of_learning(wildcards):
    return sorted({path for figure in figures_of(RUNS) for path in for_targets(figure)})


def labels(figure):
    return {"dataset": "{dataset}", "model": "{model}", "recipe": "{recipe}", "figure": figure}


def sweep_figures(ladder):
    """Figures of the sweep of one dataset, model, recipe and number of scales."""
    return [f"results/figures/{ladder}/sweep/{name}.png" for name in ("history", "importance", "slices", "contours")]


# ---- sweep


def sweep_section(*left_out):
    """Settings of the sweep without those that a rule does not depend on."""
    return {key: value for key, value in dump(SETTINGS.sweep()).items() if key not in left_out}


def sweep_labels(figure):
    return {"dataset": SWEEP.dataset, "model": SWEEP.model, "recipe": SWEEP.recipe, "figure": figure}


# ---- diagnosis


def found_model(dataset):
    """The model that the diagnosis of a dataset found."""
    summary = checkpoints.diagnose_dataset.get(dataset=dataset).output.summary
    return json.loads(Path(summary).read_text(encoding="utf-8"))["model"]


def networks_of(wildcards):
    """Evaluations of the networks of a dataset that `rule all` trains; those that follow a verdict come last."""
    dataset = wildcards.dataset
    if dataset not in SETTINGS.targets.datasets:
        return []
    followed = found_model(dataset) if dataset in SETTINGS.targets.follow_verdict else None
    return networks_with(dataset, followed)


def networks_with(dataset, followed):
    """Evaluations of the networks of a dataset, with the model that its verdict found, or None."""
    targets, pattern = SETTINGS.targets, f"results/learning/{LADDER}/evaluation.csv"
    paths = for_targets(pattern, [dataset])
    if followed is not None:
        paths += expand(pattern, dataset=dataset, model=followed, recipe=targets.recipes, scales=min(targets.scales))
    return list(dict.fromkeys(paths))


def evaluations(wildcards):
    """Evaluations of all networks that `rule all` trains. Which ones follow a verdict is known after the diagnosis."""
    of_dataset = (networks_of(SimpleNamespace(dataset=dataset)) for dataset in SETTINGS.targets.datasets)
    return [path for paths in of_dataset for path in paths]


def networks_beside(wildcards):
    """Evaluations of further networks of a dataset that were trained on demand.

    Not a function of the rule's input: Snakemake compares only params that are not, and a new network has to be seen.
    """
    dataset, planned = wildcards.dataset, []
    if dataset in SETTINGS.targets.datasets:
        summary = Path(DIAGNOSIS.format(dataset=dataset), "summary.json")
        follows = dataset in SETTINGS.targets.follow_verdict and summary.exists()
        planned = networks_with(dataset, json.loads(summary.read_text(encoding="utf-8"))["model"] if follows else None)
    trained = Path().glob(f"results/learning/{dataset}/*/*/*-scale/evaluation.csv")
    return sorted(set(map(str, trained)) - set(planned))


def verdicts(wildcards):
    return expand("results/diagnosis/{dataset}/verdict.html", dataset=SETTINGS.targets.datasets)


def published_diagnoses():
    """(folder of the results, folder of the pictures, time it took) of every diagnosis that MLflow shows."""
    return [diagnosis_paths(dataset) for dataset in SETTINGS.targets.datasets]


def diagnosis_paths(dataset):
    return [part.format(dataset=dataset) for part in (DIAGNOSIS, DIAGNOSIS_PICTURES, DIAGNOSIS_TIME)]


# ---- tracking


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


# The protocols of the paper, Secs. 4 and 5.
PAPER_CASES = ["case1", "case2", "case3"]
PAPER_SUBJECTS = ["elbow_literature", "elbow_bounds"]
PAPER_RUNS = [f"{case}/base/paper" for case in PAPER_CASES] + [f"{name}/base/paper_subject" for name in PAPER_SUBJECTS]


# What each choice of its recipe does, on one case with 1-scale training; the recipe as printed comes first.
PAPER_CHOICES = [
    "paper", "paper_light", "paper_sequence", "paper_sequence_quiet", "paper_sequence_light", "paper_sequence_light_quiet",
]  # fmt: skip
PAPER_CHOICE = "results/learning/case1/base/{recipe}/1-scale/{file}"


def paper_scales(dataset):
    """Numbers of scales: 1 to 3 in Sec. 4, 1 to 5 in Sec. 5; with true bounds, which the paper lacks, both ends."""
    return {"elbow_literature": [1, 2, 3, 4, 5], "elbow_bounds": [1, 5]}.get(dataset, [1, 2, 3])


def of_paper(pattern):
    """An input function: the pattern for every number of scales, and every level within."""
    return lambda wildcards: sorted(
        {
            pattern.format(**wildcards, scales=scales, level=level)
            for scales in paper_scales(wildcards.dataset)
            for level in range(scales)
        }
    )


def paper_evaluations(datasets, recipe, file="evaluation.csv"):
    return [
        f"results/learning/{dataset}/base/{recipe}/{scales}-scale/{file}"
        for dataset in datasets
        for scales in paper_scales(dataset)
    ]


def paper_runs(file):
    """A file of every network of the paper's protocols."""
    protocols = paper_evaluations(PAPER_CASES, "paper", file) + paper_evaluations(PAPER_SUBJECTS, "paper_subject", file)
    return list(dict.fromkeys(protocols + expand(PAPER_CHOICE, recipe=PAPER_CHOICES, file=file)))
