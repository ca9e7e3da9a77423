"""What studies share: settings of their own, what is done to recordings, words for grades, and tables of Markdown."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from pydantic import ValidationError
from scipy.signal import butter, sosfiltfilt

from myowave.data.trials import Array, Trials
from myowave.settings import Section, Settings
from myowave.settings.keys import explain

# What pages call the grade of an answer.
GRADES = {"right": "right", "class": "class", "honest": "left open", "silent": "missed", "wrong": "wrong"}


class StudySection(Section):
    """Settings of a study, checked like any others, and against those of the core."""

    def problems(self, settings: Settings) -> list[str]:
        """What does not fit the settings of the core, one line each, with the key below the section."""
        raise NotImplementedError


S = TypeVar("S", bound=StudySection)


def read_section(kind: type[S], name: str, values: Mapping[str, Any], settings: Settings) -> S:
    """The section of a study.

    Raises:
        ValueError: one line per problem, each with the key, what was found and what is allowed.
    """
    try:
        section = kind.model_validate(values)
    except ValidationError as error:
        problems = explain(error, kind)
    else:
        problems = section.problems(settings)
        if not problems:
            return section
    raise ValueError("\n".join(f"{name}.{problem}" for problem in problems))


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table."""
    return "\n".join(f"| {' | '.join(cells)} |" for cells in [heads, ["---"] * len(heads), *rows])


def put_in(
    trials: Trials, names: Collection[str], channels: Collection[str] = (), gain: float = 1.0, late_s: float = 0.0
) -> Trials:
    """Trials whose EMG is larger and later by hand in some of them, of some channels, all where none is named."""
    held = np.minimum(np.arange(trials.emg.shape[1]), np.array(trials.lengths)[:, None] - 1)
    earlier = (held - round(late_s / trials.dt)).clip(0)
    mine = np.isin(trials.channels, list(channels) or trials.channels) & np.isin(trials.names, list(names))[:, None]
    put = gain * np.take_along_axis(trials.emg, earlier[..., None], 1)
    return replace(trials, emg=np.where(mine[:, None], put, trials.emg))


def low_pass(values: Array, edge_hz: float, dt: float) -> Array:
    """Signals (T, N, ...) through a Butterworth filter forwards and backwards."""
    return np.asarray(sosfiltfilt(butter(2, 2 * edge_hz * dt, output="sos"), values, axis=1), dtype=np.float64)
