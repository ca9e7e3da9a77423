"""From a table of cells to signals: the part that all readers of tables share."""

import numpy as np
import pandas as pd

from myowave.data.readers.signals import Signal


def to_signals(frame: pd.DataFrame, header: list[str]) -> tuple[Signal, ...]:
    """A signal for each column.

    Args:
        frame: one row per sample; cells are numbers, or text that may hold one.
        header: names of the columns, which may repeat.
    """
    return tuple(_to_signal(name, frame.iloc[:, column]) for column, name in enumerate(header))


def _to_signal(name: str, cells: pd.Series) -> Signal:
    values = pd.to_numeric(cells, errors="coerce").to_numpy(dtype=np.float64)
    odd = (~np.isfinite(values)).nonzero()[0]
    return Signal(name, values, odd={int(sample): cells.iloc[sample] for sample in odd})
