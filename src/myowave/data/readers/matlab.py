"""MATLAB's .mat files up to version 7: every variable that holds samples is a signal."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from myowave.data.readers.signals import RawRecording, Signal

_TIMES = {"time", "t"}
_RATES = {"fs", "rate", "samplingrate", "frequency", "freq"}
_FILLING = {"s", "ms", "hz", "sampling", "sample"}  # of which signal a rate or times are is what the other words say
SHORTEST = 0.75  # samples of a signal, as a share of the longest of its rate [-]: an angle beside EMG has half or fewer
_NUMBERS = (int, float, np.integer, np.floating)


def read_matlab(path: Path) -> RawRecording:
    """Read one file.

    A vector is a signal of its variable's name; column 2 of a matrix `emg` is `emg(2)`, as is what a cell has there; a
    field of a structure is `trial.emg`. A variable time (time_s, time_ms, t) of as many samples beside it gives the
    times, a number fs (rate, ...) the samples a second. `fs_emg` and `time_emg` are for signals with emg in their name.
    """
    try:
        content = loadmat(path, simplify_cells=True)
    except NotImplementedError:
        raise ValueError(
            f"{path}: a .mat file of version 7.3, which is another format. In MATLAB, save it again with "
            "save(file, '-v7')."
        ) from None
    except (MatReadError, ValueError, TypeError) as error:
        raise ValueError(f"{path}: this is not a MATLAB file ({error}). Save it again from MATLAB.") from None
    signals = tuple(_signals({name: value for name, value in content.items() if not name.startswith("__")}))
    if not signals:
        raise ValueError(f"{path}: no vector or matrix of numbers in it; expected signals with at least 2 samples.")
    return RawRecording(path, signals)


def _signals(variables: Mapping[str, Any], prefix: str = "") -> Iterator[Signal]:
    """Signals of a structure, and of those in it."""
    rates = {n: float(v) for n, v in variables.items() if _words(n) & _RATES and isinstance(v, _NUMBERS)}
    variables = dict(_parts(variables))
    arrays = {n: array for n, value in variables.items() if (array := _array(value)) is not None}
    times = {n: a[:, 0] / (1000 if "ms" in _words(n) else 1) for n, a in arrays.items() if _is_time(n, a)}
    arrays = {n: array for n, array in arrays.items() if n not in times}
    rate_of = {name: _of(name, rates, _RATES) for name in arrays}
    for name, array in arrays.items():
        time = _of(name, {n: t for n, t in times.items() if len(t) == len(array)}, _TIMES)
        longest = max(len(other) for n, other in arrays.items() if rate_of[n] == rate_of[name])
        rate = rate_of[name] if len(array) > SHORTEST * longest else None  # of one recording, it is at another rate
        for column in range(array.shape[1]):
            label = f"{prefix}{name}" + (f"({column + 1})" if array.shape[1] > 1 else "")
            yield Signal.of(label, array[:, column], time=time, rate=rate)
    for name, value in variables.items():
        if isinstance(value, Mapping):
            yield from _signals(value, f"{prefix}{name}.")


def _parts(variables: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Variables, and in place of a cell or an array of structures what is in it: `emg(2)`."""
    for name, value in variables.items():
        if isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
            inside = np.ravel(np.array(value, dtype=object), order="F")
            yield from _parts({f"{name}({n})": each for n, each in enumerate(inside, start=1)})
        else:
            yield name, value


def _words(name: str) -> set[str]:
    """Words of a variable's name in small letters: `fs_EMG` and `fsEmg` are `fs` and `emg`."""
    return set(re.findall(r"[a-z]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower()))


def _is_time(name: str, array: NDArray[np.float64]) -> bool:
    """Whether a variable holds times; where its name has other words as well, as `emg_t` has, it rises all along."""
    words = _words(name)
    if not words & _TIMES or array.shape[1] > 1:
        return False
    return not words - _TIMES - _FILLING or bool((np.diff(array[:, 0]) > 0).all())


def _of(name: str, stated: Mapping[str, Any], kind: set[str]) -> Any:
    """What is stated for a signal: by the most words that its name has too, or for all; None where nothing is."""
    known = {label: _words(label) - kind - _FILLING for label in stated}
    fitting = [label for label, words in known.items() if words <= _words(name)]
    return stated[max(fitting, key=lambda label: len(known[label]))] if fitting else None


def _array(value: Any) -> NDArray[Any] | None:
    """Samples along the first axis, (N, K), as text where they are complex; None for what holds none."""
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "iufc" or value.ndim > 2 or value.size < 2:
        return None
    array = np.atleast_2d(value.astype(str if value.dtype.kind == "c" else np.float64))
    return array if array.shape[0] > array.shape[1] else array.T  # a recording has more samples than channels
