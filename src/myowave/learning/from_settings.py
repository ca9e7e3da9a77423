"""From the plain data that rules are given to a task: the only place of learning that knows settings of the physics."""

from collections.abc import Mapping
from typing import Any

from myowave.data.trials import Trials
from myowave.data.wavelets import thin_scales
from myowave.learning.task import Task
from myowave.models import build_model
from myowave.settings import Identify, Physics, Wavelet, parse_recipe

Plain = Mapping[str, Any]


def build_task(
    scales: Mapping[int, Trials],
    model: str,
    *,
    physics: Plain,
    recipe: Plain,
    identify: Plain,
    total: int,
    seeds: int,
    wavelet: Plain | None = None,
) -> Task:
    """The task that sections of the settings ask for, checked; of the model of this name, such as base+joint_damping.
    The wavelet is for scales of trials that the recipe thins; None where they were thinned before."""
    parsed = parse_recipe(recipe)
    if wavelet is not None:
        scales = thin_scales(scales, parsed.rate_hz, total - 1, Wavelet.model_validate(wavelet).name)
    wanted = {name: Identify.model_validate(values) for name, values in identify.items()}
    return Task(scales, build_model(model, Physics.model_validate(physics)), parsed, wanted, total, range(seeds))
