# What plain `snakemake` makes, by the section `targets`: figures, networks, verdicts.
from myowave.data.json_files import read_json

TARGETS = SETTINGS.targets
EVALUATION = f"results/learning/{NETWORK}/evaluation.csv"
LEARNING_PICTURES = ("predictions", "metrics", "parameters")

SUMMARIES = ["results/summary.csv", "results/scales.csv"] if TARGETS.datasets else []
VERDICTS = [
    *expand("results/diagnosis/{dataset}/verdict.html", dataset=TARGETS.diagnosed),
    *(f"results/diagnosis/{name}/changed.html" for name in TARGETS.diagnosed if DATASETS[name].changed),
]
FIGURES_OF_DATA = [
    *expand("results/figures/{dataset}/{figure}.png", dataset=TARGETS.diagnosed, figure=["trials", "scales"]),
    *(f"results/figures/{name}/recording" for name in TARGETS.diagnosed if name in RECORDED),
]


def models_of(dataset):
    """The physical models of a dataset."""
    return TARGETS.models.get(dataset, ("base",))


def of_networks(pattern, dataset, models, scales=()):
    """The pattern for each network of a dataset with these models and numbers of scales, by all of its recipes."""
    return expand(pattern, dataset=dataset, recipe=TARGETS.recipes_of(dataset), model=models, scales=scales)


FIGURES_OF_LEARNING = [
    path
    for dataset in TARGETS.datasets
    for figure in LEARNING_PICTURES
    for path in of_networks(f"results/figures/{RUNS}/{figure}.png", dataset, models_of(dataset))
]


def networks_with(dataset, found=None):
    """Evaluations of the networks of a dataset; last those with the model that its diagnosis found, where there are any.

    Args:
        found: summary.json of the diagnosis that the networks follow.
    """
    paths = of_networks(EVALUATION, dataset, models_of(dataset), TARGETS.scales)
    if found is not None:
        model = read_json(found)["model"]
        paths += of_networks(EVALUATION, dataset, model, min(TARGETS.scales))
    return list(dict.fromkeys(paths))


def networks_of(dataset):
    """Evaluations of the networks of a dataset; the model of those that follow its verdict is known once it is there."""
    if dataset not in TARGETS.datasets:
        return []
    if dataset not in TARGETS.follow_verdict:
        return networks_with(dataset)
    return networks_with(dataset, checkpoints.diagnose_dataset.get(dataset=dataset).output.summary)


def baselines(dataset="{dataset}"):
    """Evaluations of the baselines of a dataset."""
    return expand(EVALUATION, dataset=dataset, model="base", recipe=SETTINGS.learning.baselines, scales=1)


def evaluations(wildcards):
    """Evaluations of the networks and baselines of all datasets."""
    return [path for dataset in TARGETS.datasets for path in [*networks_of(dataset), *baselines(dataset)]]


def networks_beside(dataset="*"):
    """Evaluations of further networks of a dataset, or of all: trained on demand, or by runs with other settings.

    Not a function of a rule's input: Snakemake compares only params that are not, and a new network has to be seen.
    """
    planned = []
    for name in TARGETS.datasets:
        summary = Path(f"results/diagnosis/{name}/summary.json")
        follows = name in TARGETS.follow_verdict and summary.exists()
        planned += [*networks_with(name, summary if follows else None), *baselines(name)]
    trained = Path().glob(f"results/learning/{dataset}/*/*/*-scale/evaluation.csv")
    return sorted(set(map(str, trained)) - set(planned))
