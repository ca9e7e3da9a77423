"""A new study from a folder of recordings: a file of settings to read, correct, and lay over config.yaml."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from myowave.settings import parse_settings
from myowave.settings.files import lay_over, read_layers
from myowave.settings.physics import Arm
from myowave.starting.arm import PRESET, Choice
from myowave.starting.draft import Draft, shown
from myowave.starting.files import recordings_in
from myowave.starting.prepared import prepared_draft, prepared_in
from myowave.starting.raw import raw_draft
from myowave.starting.subject import Body, check_name

_LOOK = {"recorded": "results/figures/{name}/recording", "measured": "results/figures/{name}/trials.png"}


@dataclass(frozen=True)
class Study:
    """A new study.

    Args:
        text: of its file of settings.
        said: for the terminal: what was guessed, what is left to do, and the commands to run.
    """

    text: str
    said: str


def new_study(
    name: str,
    folder: Path,
    target: Path,
    config: Sequence[Path] = (Path("config.yaml"),),
    body: Body | None = None,
    arm: str = PRESET,
) -> Study:
    """Settings for the recordings in a folder. Nothing is written.

    Args:
        name: of the study.
        folder: with its recordings.
        target: file that the settings will be in.
        config: files that they are laid over.
        body: the person, where known.
        arm: name of the arm, or `default`.

    Raises:
        ValueError: if nothing in the folder is recognised, or the name is taken.
    """
    check_name(name, "a study")
    below = read_layers(config)
    data = below.get("data")
    if isinstance(data, dict) and name in (data.get("datasets") or {}):
        raise ValueError(f"there is a dataset {name} in {', '.join(map(str, config))} already; choose another name.")
    choice = Choice(arm, body, _groups(below, arm))
    files = recordings_in(folder)
    prepared = prepared_in(folder, files)
    draft = prepared_draft(name, folder, prepared, choice) if prepared else raw_draft(name, folder, files, choice)
    text = _text(name, folder, draft)
    problems = _problems(lay_over(below, yaml.safe_load(text)))
    return Study(text, _said(name, target, config, draft, problems))


def _groups(config: Mapping[str, Any], arm: str) -> tuple[str, ...]:
    """Groups of muscles of an arm of the settings; none where there is no such arm, or it is not right."""
    try:
        return Arm.model_validate(config["physics"]["arms"][arm]).groups
    except (KeyError, TypeError, ValidationError):
        return ()


def begin(
    name: str,
    folder: Path,
    config: Sequence[Path],
    person: tuple[float | None, float | None, str | None],
    arm: str,
    force: bool,
) -> str:
    """Write NAME.yaml into this folder.

    Args:
        name, folder, config, arm: as `new_study` has them.
        person: mass [kg], height [m] and sex, all or none of them.
        force: write over a file that is there.

    Returns:
        What to say on the terminal.

    Raises:
        ValueError: as `new_study`, and if the file is there, or the person is known by half.
    """
    mass, height, sex = person
    known = mass is not None and height is not None and sex is not None
    if not known and any(part is not None for part in person):
        raise ValueError("--mass, --height and --sex are given together, or none of them.")
    body = Body(mass, height, sex) if mass is not None and height is not None and sex is not None else None
    target = Path(f"{name}.yaml")
    if target.exists() and not force:
        raise ValueError(f"{target} is there already; choose another name, or write over it with --force.")
    study = new_study(name, folder, target, config, body, arm)
    target.write_text(study.text, encoding="utf-8")
    return study.said


def _text(name: str, folder: Path, draft: Draft) -> str:
    arm = ["physics:", "  arms:", f"    {name}:", *draft.arm.lines, ""] if draft.arm.lines else []
    lines = [
        f"# The study {name}, from the recordings in {shown(folder)}. docs/real_arm.md explains it.",
        "# GUESSED: from names of files and columns, so look at it. FILL IN: only you know it.",
        "",
        "targets: # diagnosed without training a network; name it in datasets instead to train networks as well,",
        f"  # and for EMG that was recorded raw add own_recipes: {{{name}: [recorded]}}",
        "  datasets: []",
        f"  without_networks: [{name}]",
        "  follow_verdict: []",
        "",
        *arm,
        "data:",
        "  datasets:",
        f"    {name}:",
        *draft.lines,
    ]
    return "\n".join(lines) + "\n"


def _problems(config: dict[str, object]) -> list[str]:
    """What the settings still lack, a line each."""
    try:
        parse_settings(config)
    except ValueError as error:
        return str(error).splitlines()
    return []


def _said(name: str, target: Path, config: Sequence[Path], draft: Draft, problems: Sequence[str]) -> str:
    over = " ".join(map(str, [*config, target]))
    sections = [
        ("Guessed", draft.guessed),
        ("Test trial", (f"{draft.trials[-1]}, the last",)),
        ("Arm", (draft.arm.name or "that of the paper",)),
        (f"For you, in {target}", draft.to_do),
        ("Before it runs, correct", problems),
    ]
    lines = [line for title, facts in sections if facts for line in (f"{title}:", *(f"  {fact}" for fact in facts))]
    look, page = _LOOK[draft.kind].format(name=name), f"results/diagnosis/{name}/verdict.html"
    return "\n".join(
        [
            *lines,
            f"Wrote {target}. Then, to look at the recordings in {look}:",
            f"  snakemake --cores 2 {look} --configfile {over}",
            f"and to diagnose them, into {page}:",
            f"  snakemake --cores 2 --configfile {over}",
        ]
    )
