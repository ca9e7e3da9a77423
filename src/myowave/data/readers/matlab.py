"""MATLAB's .mat files up to version 7: every variable that holds samples is a signal."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from myowave.data.readers.signals import RawRecording, Signal

_TIMES = ("time", "time_s", "t")
_RATES = ("fs", "rate", "rate_hz", "sampling_rate", "samplingrate", "frequency", "freq")
_NUMBERS = (int, float, np.integer, np.floating)


def read_matlab(path: Path) -> RawRecording:
    """Read one file.

    A vector is a signal of its variable's name, column 2 of a matrix `emg` is `emg(2)`, and a field of a structure is
    `trial.emg`. A variable time (time_s, t) of as many samples beside it gives the times in s, a number fs (rate, ...)
    the samples a second.

    Raises:
        ValueError: if it is no .mat file of version 7 or before, or holds no samples.
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
    arrays = {n: a for n, a in ((n, _array(v)) for n, v in variables.items()) if a is not None}
    times = next((arrays[n][:, 0] for n in arrays if n.lower() in _TIMES and arrays[n].shape[1] == 1), None)
    rate = next((float(v) for n, v in variables.items() if n.lower() in _RATES and isinstance(v, _NUMBERS)), None)
    for name, array in arrays.items():
        if name.lower() in _TIMES:
            continue
        time = times if times is not None and len(times) == len(array) else None
        for column in range(array.shape[1]):
            values = array[:, column]
            label = f"{prefix}{name}" + (f"({column + 1})" if array.shape[1] > 1 else "")
            odd = {int(n): float(values[n]) for n in (~np.isfinite(values)).nonzero()[0]}
            yield Signal(label, values, time=time, rate=rate, odd=odd)
    for name, value in variables.items():
        if isinstance(value, Mapping):
            yield from _signals(value, f"{prefix}{name}.")


def _array(value: Any) -> NDArray[np.float64] | None:
    """Samples along the first axis, (N, K); None for what holds none."""
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "iuf" or value.ndim > 2 or value.size < 2:
        return None
    array = np.atleast_2d(value.astype(np.float64))
    return array if array.shape[0] > array.shape[1] else array.T  # a recording has more samples than channels
