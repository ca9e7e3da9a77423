"""Whether EMG is a fraction of a maximum, and whether angle and torque are those of an elbow, and change."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from myowave.data.recording import Recording

EMG_LIMIT = 1.5
"""Largest EMG taken as a fraction of a maximum voluntary contraction [-]; more means it was not normalised."""
STILL = 1e-6
"""An angle [rad] or a torque [N m] that stays within this was not measured: an arm trembles even where it holds
still, and filters leave no more of a constant."""
TORQUE_LIMIT = 300.0
"""Largest torque about an elbow [N m]; more is in another unit."""


def emg_problems(recording: Recording, forms: Mapping[str, str]) -> Iterator[str]:
    """The value of each of some channels that is farthest outside 0 to `EMG_LIMIT`.

    Args:
        forms: {channel: raw, envelope or fraction}.
    """
    for name, form in forms.items():
        emg = recording.emg[:, recording.channels.index(name)]
        outside = np.maximum(-emg, emg - EMG_LIMIT)
        n = int(outside.argmax())
        if outside[n] > 0:
            yield (
                f"{recording.at(n)}: {name} is {emg[n]:.3g} of a maximum contraction ({(outside > 0).sum()} samples "
                f"outside; it spans {emg.min():.3g} to {emg.max():.3g}); expected 0 to {EMG_LIMIT:g}. "
                f"{_NORMALISE if form == 'fraction' else _ARTEFACT}"
            )


_NORMALISE = "Rectify and smooth the EMG, and divide it by its value at maximum contraction (percent by 100)."
_ARTEFACT = "Look for an artefact there and cut it off with cut_s, or name a stronger contraction under mvc."


def angle_problems(recording: Recording) -> Iterator[str]:
    """An angle that never moves, is beyond half a turn, or looks like the other unit."""
    angle, unit = np.degrees(recording.angle), recording.angle_unit
    n = int(np.abs(angle).argmax())
    span = f"goes from {angle.min():.4g} to {angle.max():.4g} deg"
    if abs(angle[n]) > 180:
        in_degrees = "If it was written in deg, name that unit (or call the column angle_deg); else correct"
        yield (
            f"{recording.at(n)}: the angle is {angle[n]:.4g} deg (it {span}); expected -180 to 180. "
            f"{in_degrees if unit == 'rad' else 'Correct its unit,'} sign or offset_deg."
        )
    elif np.ptp(recording.angle) < STILL:
        yield (
            f"{recording.origin}: the angle stays at {angle[0]:.4g} deg in all {len(angle)} samples. The sensor was "
            "off, or the column is another one: correct it, or leave the trial out."
        )
    elif unit == "deg" and abs(angle[n]) < math.pi:
        yield (
            f"{recording.origin}: the angle {span}, which no elbow motion does. If it was written in rad, name that "
            "unit (or call the column angle_rad)."
        )


def torque_problems(recording: Recording) -> Iterator[str]:
    """A torque that no elbow gives, or that never changes."""
    torque = recording.torque
    if torque is None:
        return
    n = int(np.abs(torque).argmax())
    if abs(torque[n]) > TORQUE_LIMIT:
        yield (
            f"{recording.at(n)}: the torque is {torque[n]:.4g} N m (it goes from {torque.min():.4g} to "
            f"{torque.max():.4g}); expected -{TORQUE_LIMIT:g} to {TORQUE_LIMIT:g}. Correct its unit: N cm and N mm are "
            "others."
        )
    elif np.ptp(torque) < STILL:
        yield (
            f"{recording.origin}: the torque stays at {torque[0]:.4g} N m in all {len(torque)} samples. The "
            "dynamometer was off: remove the column, or leave the trial out of torque.trials."
        )
