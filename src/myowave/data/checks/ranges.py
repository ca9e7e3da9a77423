"""Whether EMG is a fraction of a maximum voluntary contraction, and an angle what its column says, and moves."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from myowave.data.readers import RawRecording

EMG_LIMIT = 1.5
"""Largest EMG taken as a fraction of a maximum voluntary contraction [-]; more means it was not normalised."""


STILL = 1e-6
"""An angle that stays within this [rad] was not measured on an arm, which trembles even where it holds still."""


def emg_problems(recording: RawRecording, channels: Sequence[str]) -> Iterator[str]:
    """The first value of each channel outside 0 to `EMG_LIMIT`."""
    for name in channels:
        emg = recording[name].values
        outside = ((emg < 0) | (emg > EMG_LIMIT)).nonzero()[0]
        if len(outside):
            n = outside[0]
            yield (
                f"{recording.at(n)}: {name} is {emg[n]:g} ({len(outside)} rows outside; the column spans "
                f"{emg.min():g} to {emg.max():g}); expected 0 to {EMG_LIMIT:g}. Rectify and smooth the EMG, and divide "
                "it by its value at maximum voluntary contraction."
            )


TORQUE_LIMIT = 300.0
"""Largest torque about an elbow [N m]; more is in another unit."""


def torque_problems(recording: RawRecording, column: str) -> Iterator[str]:
    """A torque that no elbow gives, or that never changes."""
    torque = recording[column].values
    n = int(np.abs(torque).argmax())
    if abs(torque[n]) > TORQUE_LIMIT:
        yield (
            f"{recording.at(n)}: {column} is {torque[n]:g} (the column spans {torque.min():g} to {torque.max():g}); "
            f"expected -{TORQUE_LIMIT:g} to {TORQUE_LIMIT:g} N m. If these are N cm or N mm, convert them."
        )
    elif np.ptp(torque) == 0:
        yield (
            f"{recording.path}: {column} stays at {torque[0]:g} in all {len(torque)} rows. The dynamometer was off: "
            "remove the column."
        )


def angle_problems(recording: RawRecording, column: str) -> Iterator[str]:
    """An angle that never moves, is beyond half a turn, or looks like the other unit.

    Args:
        column: angle_rad or angle_deg.
    """
    angle = recording[column].values
    n = int(np.abs(angle).argmax())
    span = f"the column spans {angle.min():g} to {angle.max():g}"
    if column == "angle_rad" and abs(angle[n]) > math.pi:
        yield (
            f"{recording.at(n)}: angle_rad is {angle[n]:g} ({span}); expected -pi to pi. If these are degrees, call "
            "the column angle_deg."
        )
    elif column == "angle_deg" and abs(angle[n]) > 180:
        yield f"{recording.at(n)}: angle_deg is {angle[n]:g} ({span}); expected -180 to 180."
    elif column == "angle_deg" and abs(angle[n]) < math.pi:
        yield (
            f"{recording.path}: angle_deg never leaves {-math.pi:.2f} to {math.pi:.2f} ({span}), which no elbow motion "
            "does. If these are radians, call the column angle_rad."
        )
    elif math.isclose(angle.min(), angle.max(), rel_tol=0, abs_tol=STILL):
        yield (
            f"{recording.path}: {column} stays at {angle[0]:g} in all {len(angle)} rows. The sensor was off, or the "
            "column is another one: correct the file, or leave the trial out."
        )
