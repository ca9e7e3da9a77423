"""What a network is given of a trial at every sample: its EMG, and what else is known.

The EMG of 1 kg and of 2.5 kg do not mean the same motion. So a constant that is known and differs between the training
trials, such as `load`, is an input beside the EMG, constant over its trial; and so is a further angle that was recorded
over time, such as `tilt_rad`, in place of the constant that it gives.

Or EMG is made to mean the same with every load: it counts over the torque that holds the level forearm with it, which
physics knows of loads that no trial had.

Shapes: T trials, N samples, C EMG channels, K known inputs.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from myowave.data.trials import TORQUE, Trials
from myowave.physics.constants import Constant, constant_of
from myowave.physics.joint import forearm
from myowave.physics.model import Model
from myowave.settings import Inputs

LOAD = "load"
Array = TypeVar("Array", Tensor, NDArray[np.float64])
Known = Mapping[str, float]  # known input: its value in a trial that does not name it
NOTHING: Known = MappingProxyType({})


@dataclass(frozen=True)
class Given:
    """What is given of a trial beside EMG, and what a network is told of it."""

    # all of it; `told` the names of the first of these, which are inputs of the network
    known: Known = field(default_factory=dict)
    told: tuple[str, ...] = ()
    # torque that holds the level forearm without a load [N m], and what each kg of load adds [N m/kg], where EMG counts
    # over it; else ()
    holding: tuple[float, ...] = ()

    @classmethod
    def of(cls, trials: Trials, model: Model, settings: Inputs) -> "Given":
        """Of the training trials, as the settings of a recipe or baseline want it; a ValueError where none has EMG."""
        if not trials.channels:
            raise ValueError(
                f"dataset {trials.dataset!r}: its arm has no muscles, so there is no EMG for a network. Name it under "
                f"targets.without_networks, and ask for its page: results/diagnosis/{trials.dataset}/verdict.html."
            )
        differ = known_inputs(trials, model.defaults)
        wanted = differ if settings.known_inputs is None else settings.known_inputs
        known = {name: value for name, value in differ.items() if name in wanted}
        if settings.emg_over == "maximum" or LOAD not in trials.known(model.defaults):
            return cls(known, tuple(known))
        # ASSUME: what else is known of the forearm is the same in all trials.
        constants = {name: trials.condition(name, model.defaults[name]).mean() for name in model.joint}
        body = forearm({name: torch.tensor(value) for name, value in constants.items()})
        without, with_one = float(body.weight_with(0.0)), float(body.weight_with(1.0))
        return cls(known | {LOAD: model.defaults[LOAD]}, tuple(known), (without, with_one - without))

    def see(self, inputs: Array) -> Array:
        """What the network sees of EMG and all that is known, (..., C + K): EMG and what it is told."""
        if not self.holding:
            return inputs
        channels = inputs.shape[-1] - len(self.known)
        load = channels + list(self.known).index(LOAD)
        without, by_load = self.holding
        # ASSUME: the EMG of a motion grows as the torque that holds the level forearm does. Strengths and moment arms
        # are those of all trials alike, so that dividing by them as well would change nothing once inputs are scaled.
        torque = without + by_load * inputs[..., load : load + 1]
        seen = 1.0 * inputs[..., : channels + len(self.told)]
        seen[..., :channels] /= torque
        return seen


def known_inputs(trials: Trials, defaults: Mapping[str, float]) -> Known:
    """What is known beside EMG over time, or differs between the training trials; `defaults` are those of the model."""
    differ = {
        name: defaults[name]
        for name, values in trials.known(defaults).items()
        if name not in trials.over_time and np.ptp(values) > 0
    }
    # A torque that a dynamometer measured is a result of the motion to be predicted, and none is there later.
    return differ | dict.fromkeys((name for name in trials.signals if name != TORQUE), 0.0)


def given_inputs(trials: Trials, known: Known) -> NDArray[np.float64]:
    """EMG and known inputs of trials, (T, N, C + K), or a ValueError where they lack a signal."""
    if missing := [name for name in known if name not in trials.signals and constant_behind(name) is None]:
        raise ValueError(
            f"dataset {trials.dataset!r}: no {', '.join(missing)}, which the network is given over time; the signals "
            f"are {', '.join(trials.signals) or 'none'}. Record it, or take a network without it."
        )
    columns = [
        trials.signals[name] if name in trials.signals else trials.condition(name, value)[:, None]
        for name, value in known.items()
    ]
    columns = [np.broadcast_to(column, trials.angle.shape)[..., None] for column in columns]
    return np.concatenate([trials.emg, *columns], axis=-1)


def to_tensors(trials: Trials, device: torch.device, known: Known = NOTHING) -> tuple[Tensor, Tensor]:
    """Inputs (T, N, C + K) and angle (T, N) [rad] of trials, float64; copies, so that trials stay as they are."""
    return torch.tensor(given_inputs(trials, known), device=device), torch.tensor(trials.angle, device=device)


def known_of(trials: Trials, donors: NDArray[np.int64], known: Known, samples: int) -> NDArray[np.float64]:
    """Known inputs of trials that are simulated with the constants of those at `donors`, (len(donors), samples, K)."""
    # ASSUME: a trial with EMG that nobody recorded holds an angle that is known over time at its median.
    constant = {signal: parameter for parameter, signal in trials.over_time.items()}
    values = np.empty((len(donors), samples, len(known)))
    for k, (name, value) in enumerate(known.items()):
        values[..., k] = trials.condition(constant.get(name, name), value)[donors, None]
    return values


def unit_of(name: str) -> str:
    """SI unit of a known input; angles over time are in rad."""
    constant = constant_behind(name)
    return "rad" if constant is None else constant.unit


def constant_behind(name: str) -> Constant | None:
    """The physical constant that a known input is; None for an angle over time."""
    try:
        return constant_of(name)
    except KeyError:
        return None
