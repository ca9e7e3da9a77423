# What plain `snakemake` makes, by the section `targets`: figures, networks, verdicts.
import json


def models_of(dataset):
    """The physical models of a dataset."""
    return SETTINGS.targets.models.get(dataset, ("base",))


def for_targets(pattern, datasets=SETTINGS.targets.datasets):
    """The pattern for every dataset with the models, recipes and numbers of scales that the targets name."""
    return [
        path
        for dataset in datasets
        for recipe in SETTINGS.targets.recipes_of(dataset)
        for path in expand(
            pattern,
            dataset=dataset,
            model=models_of(dataset),
            recipe=recipe,
            scales=SETTINGS.targets.scales,
        )
    ]


def of_scales(pattern):
    """An input function: the pattern for every number of scales of a recipe, and every level."""
    return lambda wildcards: list(
        dict.fromkeys(
            pattern.format(**wildcards, scales=scales, level=level)
            for scales in SETTINGS.targets.scales
            for level in range(scales)
        )
    )


def figures_of_data(wildcards):
    drawn = expand(
        "results/figures/{dataset}/{figure}.png", dataset=SETTINGS.targets.diagnosed, figure=["trials", "scales"]
    )
    return drawn + expand(
        "results/figures/{dataset}/recording", dataset=set(SETTINGS.targets.diagnosed) & set(RECORDED)
    )


def figures_of(runs):
    """Figures of one dataset, model and recipe; `runs` may hold wildcards."""
    return [f"results/figures/{runs}/{figure}.png" for figure in ("metrics", "predictions", "parameters")]


def figures_of_learning(wildcards):
    return sorted({path for figure in figures_of(RUNS) for path in for_targets(figure)})


def summaries(wildcards):
    """The table of all networks, and what more scales do for them, where there are any."""
    return ["results/summary.csv", "results/scales.csv"] if SETTINGS.targets.datasets else []


def verdicts(wildcards):
    diagnosed = SETTINGS.targets.diagnosed
    return expand("results/diagnosis/{dataset}/verdict.html", dataset=diagnosed) + expand(
        "results/diagnosis/{dataset}/changed.html", dataset=[name for name in diagnosed if DATASETS[name].changed]
    )


def found_model(summary):
    """The model that a diagnosis found, from its summary.json."""
    return json.loads(Path(summary).read_text(encoding="utf-8"))["model"]


def networks_with(dataset, followed):
    """Evaluations of the networks of a dataset, with the model that its verdict found, or None."""
    targets, pattern = SETTINGS.targets, f"results/learning/{NETWORK}/evaluation.csv"
    paths = for_targets(pattern, [dataset])
    if followed is not None:
        for recipe in targets.recipes_of(dataset):
            paths += expand(pattern, dataset=dataset, model=followed, recipe=recipe, scales=min(targets.scales))
    return list(dict.fromkeys(paths))


def networks_of(dataset):
    """Evaluations of the networks of a dataset; those that follow its verdict, known after the diagnosis, come last."""
    if dataset not in SETTINGS.targets.datasets:
        return []
    if dataset not in SETTINGS.targets.follow_verdict:
        return networks_with(dataset, None)
    return networks_with(dataset, found_model(checkpoints.diagnose_dataset.get(dataset=dataset).output.summary))


def baselines(dataset="{dataset}"):
    """Evaluations of the baselines of a dataset."""
    names = SETTINGS.learning.baselines
    return [f"results/learning/{dataset}/base/{name}/1-scale/evaluation.csv" for name in names]


def evaluations(wildcards):
    """Evaluations of the networks and baselines of all datasets."""
    return [path for dataset in SETTINGS.targets.datasets for path in [*networks_of(dataset), *baselines(dataset)]]


def networks_beside(dataset="*"):
    """Evaluations of further networks of a dataset, or of all: trained on demand, or by runs with other settings.

    Not a function of a rule's input: Snakemake compares only params that are not, and a new network has to be seen.
    """
    planned = []
    for name in SETTINGS.targets.datasets:
        summary = Path(DIAGNOSIS.format(dataset=name), "summary.json")
        follows = name in SETTINGS.targets.follow_verdict and summary.exists()
        planned += [*networks_with(name, found_model(summary) if follows else None), *baselines(name)]
    trained = Path().glob(f"results/learning/{dataset}/*/*/*-scale/evaluation.csv")
    return sorted(set(map(str, trained)) - set(planned))
