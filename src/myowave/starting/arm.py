"""The arm of a new study: the preset `arm26`, with the person's forearm, driven by the channels that were recorded.

Where those have a brachioradialis beside the biceps it is `arm26_brd`, which has that muscle.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from myowave.settings.physics import read_preset
from myowave.starting.subject import Body, joint_lines
from myowave.starting.words import EXTENSORS, FLEXORS, muscle_in

PRESET = "arm26"
PRESET_FURTHER, FURTHER = "arm26_brd", "brachioradialis"  # the same with one muscle more
_NONE = "default"
_WANTED = {"flexor": FLEXORS, "extensor": EXTENSORS}


@dataclass(frozen=True)
class Choice:
    """Which arm a person asks for.

    Args:
        name: `arm26`, another one of the settings, or `default`.
        body: the person, where known.
        groups: of muscles of another arm.
    """

    name: str = PRESET
    body: Body | None = None
    groups: tuple[str, ...] = ()


@dataclass(frozen=True)
class StudyArm:
    """The arm of a study.

    Args:
        name: to write under `arm`; None for the arm of the paper.
        lines: of its block under physics.arms; none where it is there already.
        groups: of its muscles that are driven.
        channels: that drive them; none where the arm is one of the settings.
        to_do: what is left to the person.
    """

    name: str | None
    lines: tuple[str, ...] = ()
    groups: tuple[str, ...] = ()
    channels: tuple[str, ...] = ()
    to_do: tuple[str, ...] = ()


def arm_of(study: str, channels: Sequence[str], choice: Choice) -> StudyArm:
    """The arm of a study.

    Args:
        study: its name, which a new arm gets as well.
        channels: names of its EMG channels, emg_<muscle>.
        choice: which arm.

    Raises:
        ValueError: if the person is known but the arm is not `arm26`, or a mass or height cannot be.
    """
    body = choice.body
    if choice.name != PRESET:
        if body is not None:
            raise ValueError(
                f"--arm {choice.name} has a forearm of its own; leave --arm out, or --mass, --height and --sex: "
                "`myowave subject` prints a forearm to put into it."
            )
        return StudyArm(None if choice.name == _NONE else choice.name, (), choice.groups)
    driver: dict[str, str | None] = {side: _first(channels, wanted) for side, wanted in _WANTED.items()}
    further = _first([channel for channel in channels if channel not in driver.values()], [FURTHER])
    preset = PRESET_FURTHER if further else PRESET
    muscles = read_preset(preset)["muscles"]
    if not any(driver.values()):
        driver = {side: _preset_channel(muscles.values(), side) for side in _WANTED}
    drives = {name: further if _is_further(muscle) else driver[muscle["side"]] for name, muscle in muscles.items()}
    changes = []
    for name, muscle in muscles.items():
        channel = drives[name]
        if channel is None:
            changes.append(f"        {name}: null # nobody recorded its EMG")
        elif channel != muscle["emg"]:
            changes.append(f"        {name}: {{emg: {channel}}}")
    groups = tuple(dict.fromkeys(muscle["group"] for name, muscle in muscles.items() if drives[name] is not None))
    to_do = tuple(_to_do(channels, driver, preset, muscles.values()))
    driving = tuple(channel for channel in (*driver.values(), further) if channel is not None)
    if body is None and not changes:
        return StudyArm(preset, (), groups, driving, to_do)
    lines = [f"      preset: {preset} # muscles with moment arms of an adult, and curves"]
    lines += ["      joint:", *joint_lines(body)] if body else []
    lines += ["      muscles:", *changes] if changes else []
    return StudyArm(study, tuple(lines), groups, driving, to_do)


def _first(channels: Sequence[str], wanted: Iterable[str]) -> str | None:
    """The first channel of the most wanted muscle that there is."""
    return next((c for muscle in wanted for c in channels if muscle_in(c.removeprefix("emg_")) == muscle), None)


def _preset_channel(muscles: Iterable[dict[str, str]], side: str) -> str:
    return next(muscle["emg"] for muscle in muscles if muscle["side"] == side)


def _is_further(muscle: dict[str, str]) -> bool:
    return muscle_in(muscle["emg"].removeprefix("emg_")) == FURTHER


def _to_do(
    channels: Sequence[str], driver: dict[str, str | None], preset: str, muscles: Iterable[dict[str, str]]
) -> Iterable[str]:
    needed = tuple(dict.fromkeys(muscle["emg"] for muscle in muscles))
    if not set(driver.values()) & set(channels):
        yield (
            f"no channel has the name of an elbow's muscle; {preset} is driven by {' and '.join(needed)}: rename yours "
            f"under emg ({', '.join(channels)}), each with the muscle that its electrodes were on"
        )
    for side, channel in driver.items():
        if channel is None:
            yield f"no {side} of the elbow was recorded, so {preset} goes without; the verdict stands on the other side"
