"""The command that adds what was found, as the user has to type it."""

import shlex
from collections.abc import Sequence


def adding_command(
    dataset: str, model: str, *, recipes: Sequence[str] = ("rollout",), config_files: Sequence[str] = ()
) -> str:
    """What trains networks with the model that was found, then shows them beside those without it.

    Two calls, as the page shows every network that is there when its call begins.

    Args:
        model: that was found, such as `base+joint_damping`.
        recipes: that the user's settings train with.
        config_files: what the run was given after --configfile, in order; none where it had only config.yaml.
    """
    trained = [f"results/figures/{dataset}/{model}/{recipe}/predictions.png" for recipe in recipes]
    page = f"results/diagnosis/{dataset}/verdict.html"
    # Targets come first: --configfile takes all words that follow it.
    settings = ["--configfile", *config_files] if config_files else []
    calls = (shlex.join(["snakemake", "--cores", "2", *targets, *settings]) for targets in (trained, [page]))
    return " && ".join(calls)
