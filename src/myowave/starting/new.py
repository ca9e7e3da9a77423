"""A new dataset from a folder of recordings: a file of settings to read, correct, and lay over config.yaml."""

import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from myowave.data.json_files import replacing
from myowave.data.problems import say_once
from myowave.settings import parse_settings
from myowave.settings.files import lay_over, read_layers
from myowave.settings.keys import TO_FILL_IN
from myowave.settings.physics import Arm, read_preset
from myowave.settings.recording import TRIAL
from myowave.starting.block import Block, dataset_block, shown
from myowave.starting.files import recordings_in
from myowave.starting.signals import Recorded, read_folder
from myowave.starting.subject import PRESET, check_name, joint_lines

WITH_BRACHIORADIALIS = "arm26_brd"
_PERSON = re.compile(r"(?<![a-z])(sub|subj|subject|participant|proband|vp|s|p)[-_ ]?\d+(?=[-_ /])", re.IGNORECASE)
_LOOK = {"recorded": "results/figures/{name}/recording", "measured": "results/figures/{name}/trials.png"}


def begin(
    name: str,
    folder: Path,
    config: Sequence[Path] = (Path("config.yaml"),),
    person: tuple[float | None, float | None, str | None] = (None, None, None),
    arm: str | None = None,
    force: bool = False,
) -> str:
    """Write NAME.yaml here, settings for the recordings in a folder, and return what to say on the terminal.

    Args:
        config: files that the settings are laid over.
        person: mass [kg], height [m] and sex, all or none of them.
        arm: one of the settings; None takes that of the preset for the muscles that were recorded.

    Raises:
        ValueError: if no file in the folder can be read, the name or file is there, the person is known by half, or the
            arm has a forearm of its own.
    """
    check_name(name, "a dataset")
    mass, height, sex = person
    body = None if mass is None or height is None or sex is None else (mass, height, sex)
    if body is None and person != (None, None, None):
        raise ValueError("--mass, --height and --sex are given together, or none of them.")
    if arm is not None and body is not None:
        raise ValueError(
            f"--arm {arm} has a forearm of its own; leave --arm out, or --mass, --height and --sex: `myowave subject` "
            "prints a forearm to put into it."
        )
    target = Path(f"{name}.yaml")
    below = read_layers(config)
    if any(target.resolve() == path.resolve() for path in config):
        raise ValueError(f"{target} is the configuration that the settings are laid over; choose another name.")
    if target.exists() and not force:
        raise ValueError(f"{target} is there already; choose another name, or write over it with --force.")
    data = below.get("data")
    there = data.get("datasets") if isinstance(data, Mapping) else None
    if isinstance(there, Mapping) and name in there:
        raise ValueError(f"there is a dataset {name} in {', '.join(map(str, config))} already; choose another name.")
    recorded = read_folder(folder, recordings_in(folder))
    if not recorded.signals:
        raise ValueError(f"{folder}: no recording in it can be read.\n" + "\n".join(say_once(recorded.skipped)))
    given = _arm_of(below, arm) if arm else None
    machine = given is not None and not given.muscles
    block = dataset_block(folder, recorded, machine=machine)
    preset = WITH_BRACHIORADIALIS if "emg_brachioradialis" in block.channels else PRESET
    own = [] if arm is not None else list(_arm_lines(preset, block.channels, body))
    named = arm or (name if own else preset)
    training = "; name it in datasets instead to train networks as well,\n"
    training += f"  # and for EMG that was recorded raw add own_recipes: {{{name}: [recorded]}}"
    lines = [
        f"# The dataset {name}, from the recordings in {shown(folder)}. docs/real_arm.md explains it.",
        "# GUESSED: from units and names, so look at it. FILL IN: only you know it.",
        "",
        f"targets: # diagnosed without training a network{'' if machine else training}",
        "  datasets: []",
        f"  without_networks: [{name}]",
        "  follow_verdict: []",
        "",
        *(["physics:", "  arms:", f"    {name}:", *(f"      {line}" for line in own), ""] if own else []),
        "data:",
        "  datasets:",
        f"    {name}:",
        *(f"      {line}" for line in [*block.lines, f"arm: {named}"]),
    ]
    if not block.of_maximum:
        lines += _wide_bounds(_laid_over(below, lines), named)
    said = _said(name, config, block, recorded, lines, _problems(_laid_over(below, lines)))
    with replacing(target) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return said


def _arm_lines(preset: str, channels: Sequence[str], body: tuple[float, float, str] | None) -> Iterator[str]:
    """The preset with the person's forearm, and with muscles to fill in whose EMG is not among the channels."""
    muscles = {name: muscle["emg"] for name, muscle in read_preset(preset)["muscles"].items()}
    missing = {name: channel for name, channel in muscles.items() if channels and channel not in channels}
    if body is None and not missing:
        return
    yield f"preset: {preset} # muscles with moment arms of an adult, and curves"
    yield from joint_lines(*body) if body else ()
    if missing:
        spare = [channel for channel in channels if channel not in muscles.values()]
        note = f"FILL IN {{emg: one of {', '.join(spare)}}}; null leaves it out" if spare else "nobody recorded it"
        yield "muscles:"
        yield from (f"  {name}: null # driven by {channel}: {note}" for name, channel in missing.items())


def _laid_over(below: dict[str, Any], lines: Sequence[str]) -> dict[str, Any]:
    """The settings with these lines, as if loads were filled in."""
    return lay_over(below, yaml.safe_load("\n".join(lines).replace(f"load: {TO_FILL_IN}", "load: 0")))


def _wide_bounds(config: dict[str, Any], arm: str) -> Iterator[str]:
    """Bounds of strengths, each of which holds the unknown gain of its EMG where nobody recorded a maximum."""
    found = _arm_of(config, arm)
    groups = found.groups if found else ()
    if groups:
        yield "      identify: # no maximum contraction: a strength holds the unknown gain of its EMG as well"
    for group in groups:
        yield f"        strength_{group}: {{start_spread: 0.3, low: 0.02, high: 5.0}}"
        yield f"        length_{group}: {{start_spread: 0.05, low: 0.85, high: 1.15}}"


def _arm_of(config: dict[str, Any], name: str) -> Arm | None:
    """An arm of the settings; None where there is none of that name, or it is not right."""
    try:
        return Arm.model_validate(config["physics"]["arms"][name])
    except (KeyError, TypeError, ValueError):
        return None


def _problems(config: dict[str, Any]) -> list[str]:
    """What the settings still lack, a line each."""
    try:
        parse_settings(config)
    except ValueError as error:
        return str(error).splitlines()
    return []


def _said(
    name: str, config: Sequence[Path], block: Block, recorded: Recorded, lines: Sequence[str], problems: Sequence[str]
) -> str:
    target, look = f"{name}.yaml", _LOOK[block.kind].format(name=name)
    found = ", ".join(one.signal.name for one in recorded.signals)
    besides = [f"not read: {reason}" for reason in say_once(recorded.skipped)]
    if left_out := recorded.naming.left_out:
        more = f" and {len(left_out) - 3} more" if left_out[3:] else ""
        besides.append(f"of no trial, by name or by signals: {', '.join(left_out[:3])}{more}")
    files = [pattern.replace(TRIAL, trial) for trial in recorded.naming.trials for pattern in recorded.naming.patterns]
    if len(people := dict.fromkeys(person[0] for file in files if (person := _PERSON.search(file)))) > 1:
        besides.append(f"a dataset is one person's: if {', '.join(people)} are people, name the files of one by --from")
    loads = f"data.datasets.{name}.conditions: {TO_FILL_IN} the load in each trial [kg]; 0 is an empty hand."
    marked = [line.strip() for line in lines[2:] if "GUESSED" in line or "FILL IN" in line]
    sections = {
        f"{len(block.trials)} trials": [", ".join(block.trials)],
        "EMG": [", ".join(block.channels) or f"none that names or units tell, of {found}"],
        "Besides": besides,
        f"Look at these lines of {target}": marked,
        "Before it runs, correct": [loads, *problems],
    }
    over = shlex.join([*map(str, config), target])
    return "\n".join(
        [
            *(line for title, facts in sections.items() if facts for line in (f"{title}:", *(f"  {f}" for f in facts))),
            f"Wrote {target}; names of columns stand in it, so see that none holds a person's. Then, to look at the",
            f"recordings in {look}:",
            f"  snakemake --cores 2 {look} --configfile {over}",
            f"and to diagnose them, into results/diagnosis/{name}/verdict.html:",
            f"  snakemake --cores 2 --configfile {over}",
        ]
    )
