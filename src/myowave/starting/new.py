"""A new dataset from a folder of recordings: a file of settings to read, correct, and lay over config.yaml."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from myowave.data.store import replacing
from myowave.settings import parse_settings
from myowave.settings.files import lay_over, read_layers
from myowave.settings.keys import TO_FILL_IN
from myowave.settings.physics import Arm, read_preset
from myowave.starting.block import Block, is_tidy, raw_block, shown, tidy_block
from myowave.starting.files import recordings_in
from myowave.starting.signals import read_folder
from myowave.starting.subject import Body, check_name, joint_lines

PRESET, WITH_BRACHIORADIALIS = "arm26", "arm26_brd"
_LOOK = {"recorded": "results/figures/{name}/recording", "measured": "results/figures/{name}/trials.png"}


@dataclass(frozen=True)
class NewDataset:
    """Settings of a new dataset: `text` of its file, and what is `said` on the terminal."""

    text: str
    said: str


def begin(
    name: str,
    folder: Path,
    config: Sequence[Path],
    person: tuple[float | None, float | None, str | None],
    arm: str | None,
    force: bool,
) -> str:
    """Write NAME.yaml into this folder.

    Args:
        name, folder, config, arm: as `new_dataset` has them.
        person: mass [kg], height [m] and sex, all or none of them.
        force: write over a file that is there.

    Returns:
        What to say on the terminal.

    Raises:
        ValueError: as `new_dataset`, and if the file is there, or the person is known by half.
    """
    mass, height, sex = person
    body = Body(mass, height, sex) if mass is not None and height is not None and sex is not None else None
    if body is None and any(part is not None for part in person):
        raise ValueError("--mass, --height and --sex are given together, or none of them.")
    target = Path(f"{name}.yaml")
    if target.exists() and not force:
        raise ValueError(f"{target} is there already; choose another name, or write over it with --force.")
    new = new_dataset(name, folder, config, body, arm)
    with replacing(target) as temporary:
        temporary.write_text(new.text, encoding="utf-8")
    return new.said


def new_dataset(
    name: str,
    folder: Path,
    config: Sequence[Path] = (Path("config.yaml"),),
    body: Body | None = None,
    arm: str | None = None,
) -> NewDataset:
    """Settings for the recordings in a folder. Nothing is written.

    Args:
        name: of the dataset.
        folder: with its recordings.
        config: files that the settings are laid over.
        body: the person, where known.
        arm: an arm of the settings; None takes that of the preset for the muscles that were recorded.

    Raises:
        ValueError: if no file in the folder can be read, the name is taken, or the arm has a forearm of its own.
    """
    check_name(name, "a dataset")
    if arm is not None and body is not None:
        raise ValueError(
            f"--arm {arm} has a forearm of its own; leave --arm out, or --mass, --height and --sex: `myowave subject` "
            "prints a forearm to put into it."
        )
    below = read_layers(config)
    if name in ((below.get("data") or {}).get("datasets") or {}):
        raise ValueError(f"there is a dataset {name} in {', '.join(map(str, config))} already; choose another name.")
    recorded = read_folder(folder, recordings_in(folder))
    if not recorded.signals:
        raise ValueError(f"{folder}: no recording in it can be read.\n" + "\n".join(recorded.skipped))
    block = (tidy_block if is_tidy(recorded) else raw_block)(folder, recorded)
    preset = WITH_BRACHIORADIALIS if "emg_brachioradialis" in block.channels else PRESET
    arm_lines = [] if arm is not None else list(_arm_lines(preset, block.channels, body))
    named = arm or (name if arm_lines else preset)
    text = _text(name, folder, block, named, arm_lines, _groups(below, named, arm_lines))
    loads = f"data.datasets.{name}.conditions: {TO_FILL_IN} the load in each trial [kg]; 0 is an empty hand."
    filled = yaml.safe_load(text.replace(f"load: {TO_FILL_IN}", "load: 0"))
    problems = [loads, *_problems(lay_over(below, filled))]
    notes = [f"not read: {reason}" for reason in recorded.skipped]
    left_out = recorded.naming.left_out
    if left_out:
        notes.append(
            f"of no trial: {', '.join(left_out[:3])}" + (f" and {len(left_out) - 3} more" if left_out[3:] else "")
        )
    return NewDataset(
        text, _said(name, config, block, [one.signal.name for one in recorded.signals], notes, text, problems)
    )


def _arm_lines(preset: str, channels: Sequence[str], body: Body | None) -> Iterator[str]:
    """The preset with the person's forearm, and with muscles to fill in whose EMG is not among the channels."""
    muscles = {name: muscle["emg"] for name, muscle in read_preset(preset)["muscles"].items()}
    missing = {name: channel for name, channel in muscles.items() if channel not in channels}
    if body is None and not missing:
        return
    yield f"      preset: {preset} # muscles with moment arms of an adult, and curves"
    yield from joint_lines(body) if body else ()
    if missing:
        spare = [channel for channel in channels if channel not in muscles.values()]
        yield "      muscles:"
        for name, channel in missing.items():
            told = f"FILL IN {{emg: one of {', '.join(spare)}}}; null leaves it out" if spare else "nobody recorded it"
            yield f"        {name}: null # driven by {channel}: {told}"


def _groups(config: Mapping[str, Any], arm: str, lines: Sequence[str]) -> tuple[str, ...]:
    """Groups of the muscles of an arm; none where there is no such arm, or it is not right."""
    try:
        own = yaml.safe_load("\n".join(lines)) if lines else config["physics"]["arms"][arm]
        return Arm.model_validate(own).groups
    except (KeyError, TypeError, ValueError):
        return ()


def _text(name: str, folder: Path, block: Block, arm: str, arm_lines: Sequence[str], groups: Sequence[str]) -> str:
    # Without a maximum contraction a strength holds the unknown gain of its EMG as well, so its bounds are wide.
    wide = block.kind == "recorded" and not any("normalise: mvc" in line for line in block.lines) and groups
    identify = ["      identify: # no maximum contraction: a strength holds the unknown gain of its EMG as well"]
    for group in groups:
        identify.append(f"        strength_{group}: {{start_spread: 0.3, low: 0.02, high: 5.0}}")
        identify.append(f"        length_{group}: {{start_spread: 0.05, low: 0.85, high: 1.15}}")
    lines = [
        f"# The dataset {name}, from the recordings in {shown(folder)}. docs/real_arm.md explains it.",
        "# GUESSED: from units and names, so look at it. FILL IN: only you know it.",
        "",
        "targets: # diagnosed without training a network; name it in datasets instead to train networks as well,",
        f"  # and for EMG that was recorded raw add own_recipes: {{{name}: [recorded]}}",
        "  datasets: []",
        f"  without_networks: [{name}]",
        "  follow_verdict: []",
        "",
        *(["physics:", "  arms:", f"    {name}:", *arm_lines, ""] if arm_lines else []),
        "data:",
        "  datasets:",
        f"    {name}:",
        *block.lines,
        f"      arm: {arm}",
        *(identify if wide else []),
    ]
    return "\n".join(lines) + "\n"


def _problems(config: dict[str, object]) -> list[str]:
    """What the settings still lack, a line each."""
    try:
        parse_settings(config)
    except ValueError as error:
        return str(error).splitlines()
    return []


def _said(
    name: str,
    config: Sequence[Path],
    block: Block,
    found: Sequence[str],
    notes: Sequence[str],
    text: str,
    problems: Sequence[str],
) -> str:
    target = f"{name}.yaml"
    over = " ".join([*map(str, config), target])
    marked = [line.strip() for line in text.splitlines()[2:] if "GUESSED" in line or "FILL IN" in line]
    sections = [
        (f"{len(block.trials)} trials", [", ".join(block.trials)]),
        ("EMG", [", ".join(block.channels) or f"none that names or units tell, of {', '.join(found)}"]),
        ("Besides", notes),
        (f"Look at these lines of {target}", marked),
        ("Before it runs, correct", problems),
    ]
    look, page = _LOOK[block.kind].format(name=name), f"results/diagnosis/{name}/verdict.html"
    lines = [line for title, facts in sections if facts for line in (f"{title}:", *(f"  {fact}" for fact in facts))]
    return "\n".join(
        [
            *lines,
            f"Wrote {target}; names of columns stand in it, so see that none holds a person's. Then, to look at the",
            f"recordings in {look}:",
            f"  snakemake --cores 2 {look} --configfile {over}",
            f"and to diagnose them, into {page}:",
            f"  snakemake --cores 2 --configfile {over}",
        ]
    )
