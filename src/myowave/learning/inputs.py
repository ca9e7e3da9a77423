"""What a network is given of a trial at every sample: its EMG, and what else is known.

The EMG of 1 kg and of 2.5 kg do not mean the same motion. So a constant that is known and differs between the training
trials, such as `load`, is an input beside the EMG, constant over its trial; and so is a further angle that was recorded
over time, such as `tilt_rad`, in place of the constant that it gives.

Shapes: T trials, N samples, C EMG channels, K known inputs.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from myowave.data.trials import TORQUE, Trials
from myowave.physics.constants import Constant, constant_of, is_constant

Known = Mapping[str, float]
"""{known input: its value in a trial that does not name it}"""
NOTHING: Known = MappingProxyType({})


def known_inputs(trials: Trials, defaults: Mapping[str, float]) -> Known:
    """Inputs beside EMG.

    Args:
        trials: the training trials.
        defaults: values of the physical model for trials whose conditions do not name a constant.
    """
    differ = {
        name: defaults[name]
        for name, values in trials.known(defaults).items()
        if name not in trials.over_time and np.ptp(values) > 0
    }
    # A torque that a dynamometer measured is a result of the motion to be predicted, and none is there later.
    return differ | dict.fromkeys((name for name in trials.signals if name != TORQUE), 0.0)


def given_inputs(trials: Trials, known: Known) -> NDArray[np.float64]:
    """EMG and known inputs of trials, (T, N, C + K).

    Raises:
        ValueError: where the trials lack a signal that the network was trained with.
    """
    samples = trials.emg.shape[1]
    columns = [_over_time(trials, name, value, samples) for name, value in known.items()]
    return np.concatenate([trials.emg, *(column[..., None] for column in columns)], axis=-1)


def to_tensors(trials: Trials, device: torch.device, known: Known = NOTHING) -> tuple[Tensor, Tensor]:
    """Inputs (T, N, C + K) and angle (T, N) [rad] of trials, float64; copies, so that trials stay as they are.

    Args:
        known: inputs beside EMG, `network.architecture.known`.
    """
    return torch.tensor(given_inputs(trials, known), device=device), torch.tensor(trials.angle, device=device)


def known_of(trials: Trials, donors: NDArray[np.int64], known: Known, samples: int) -> NDArray[np.float64]:
    """Known inputs of trials that are simulated with the constants of others, (len(donors), samples, K).

    Args:
        donors: positions of the trials whose constants they have.
    """
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
    return constant_of(name) if is_constant(name) else None


def _over_time(trials: Trials, name: str, value: float, samples: int) -> NDArray[np.float64]:
    if name in trials.signals:
        return trials.signals[name]
    return np.broadcast_to(trials.condition(name, value)[:, None], (len(trials.names), samples))
