# The configuration, checked; and what the rules are given of it and of the code.
import sys
from glob import glob

from snakemake.exceptions import WorkflowError

from myowave.code_digest import digest_layers
from myowave.settings import SimulatedDataset, dump, parse_settings, public

try:
    SETTINGS = parse_settings(config)
except ValueError as error:
    sys.exit(f"The configuration has problems; nothing was run.\n{error}\n`myowave settings` lists all keys.")

# Jobs see their rule's params, not the configuration: it may hold what is hidden in a dataset.
config.clear()

DATASETS = SETTINGS.data.datasets
SIMULATED = [name for name, dataset in DATASETS.items() if isinstance(dataset, SimulatedDataset)]
MEASURED = [name for name in DATASETS if name not in SIMULATED]


wildcard_constraints:
    dataset="|".join(DATASETS),
    model=r"base(\+[A-Za-z_]\w*)*",
    recipe="|".join(SETTINGS.learning.recipes),
    scales=r"[1-5]",
    level=r"[0-4]",


def one_of(names):
    """A wildcard constraint: one of these names, and nothing where there are none."""
    return "|".join(names) or "$^"


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
