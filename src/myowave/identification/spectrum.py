"""What pushes of a motion do to the waves of its angle, all of them in one pass backwards.

Shapes: T trials, N samples, K numbers of the state, M muscles, W waves.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def answers(jacobian: Array, forcing: Array, waves: Array) -> Iterator[Array]:
    """Amplitudes of waves (T, N, W) in the angle's answer to 1 more in each muscle's excitation within one step,
    (T, M, W), for each step from the last to the first.

    Args:
        jacobian, forcing: of the steps, (T, N - 1, K, K) and (T, N - 1, K, M).
    """
    by_state = np.zeros((len(waves), jacobian.shape[-1], waves.shape[-1]))  # of what comes after, by the state now
    for n in reversed(range(jacobian.shape[1])):
        by_state[:, 0] += waves[:, n + 1]
        yield np.swapaxes(forcing[:, n], -1, -2) @ by_state
        by_state = np.swapaxes(jacobian[:, n], -1, -2) @ by_state
