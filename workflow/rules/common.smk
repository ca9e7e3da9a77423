# The configuration, checked; and what rules of several files are given of it and of the code.
import sys
from pathlib import Path

from myowave.settings import dump, parse_settings, public
from myowave.workflow.digest import PACKAGE, digest_files, digest_script
from myowave.workflow.job import check_folder

try:
    check_folder("results")
except ValueError as error:
    sys.exit(str(error))

try:
    SETTINGS = parse_settings(config)
except ValueError as error:
    sys.exit(
        f"The configuration has problems; nothing was run.\n{error}\n"
        "`myowave settings WORD` finds keys, `myowave settings --all` lists all."
    )

# Jobs see their rule's params, not the configuration: it may hold what is hidden in a dataset.
config.clear()

DATASETS = SETTINGS.data.datasets
SIMULATED = [name for name, dataset in DATASETS.items() if dataset.kind == "simulated"]
RECORDED = [name for name, dataset in DATASETS.items() if dataset.kind == "recorded"]

# The coordinates of a network are the folders of its results.
RUNS = "{dataset}/{model}/{recipe}"
NETWORK = f"{RUNS}/{{scales}}-scale"


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
    return digest_script(ROOT / "workflow/scripts" / f"{script}.py")


def dataset_section(wildcards, of=public):
    """The dataset's settings that its trials are made by, without what is hidden in it unless `of` is `dump`."""
    beside = ("about", "identify", "scatter", "changed")
    return {key: value for key, value in of(DATASETS[wildcards.dataset]).items() if key not in beside}


def identify_section(wildcards):
    """The physical constants to identify, and where they start."""
    return public(DATASETS[wildcards.dataset])["identify"]


def physics_section(wildcards):
    """The physics of the dataset: its own arm, and no other."""
    return dump(SETTINGS.physics_of(wildcards.dataset))


def physics_files(wildcards):
    """Files that the dataset's physics is made of."""
    return SETTINGS.physics_of(wildcards.dataset).files


def physics_contents(wildcards):
    """Digests of these files: dates alone miss a file put back."""
    return digest_files(physics_files(wildcards))


def truth_of(dataset):
    """The truth to score against, where there is one."""
    return f"results/data/{dataset}/truth.json" if dataset in SIMULATED else []
