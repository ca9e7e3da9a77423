"""A study of raw recordings: which file holds which signal of which trial, as the block of a recorded dataset."""

import glob
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from myowave.data.readers import ENDINGS, read_raw
from myowave.settings import TextLayout
from myowave.settings.recording import TRIAL
from myowave.starting.arm import Choice, arm_of
from myowave.starting.draft import Draft, arm_lines, conditions_lines, held_out_lines, shown
from myowave.starting.files import Naming, ending_of, format_of, name_trials
from myowave.starting.roles import Found, Role, Roles, guess_roles, said_by_name, signals_of
from myowave.starting.tables import layout_of, time_column_of
from myowave.starting.words import is_technical
from myowave.starting.writing import inline_list, scalar

_GRID_HZ = 100.0  # of the trials, where the angle was recorded faster
_TOP_HZ, _NYQUIST_SHARE = 450.0, 0.45  # of the band of raw EMG that is kept
_LIKELY_DEG = (-30.0, 160.0)  # an elbow that hangs straight at 0
_PLAIN = TextLayout()
_TRIED = 4  # ways to name trials whose files are read


@dataclass(frozen=True, eq=False)
class _Read:
    """The first trial's files: their signals, how tables of text are written by pattern, and what could not be read."""

    found: tuple[Found, ...]
    layouts: Mapping[str, TextLayout]
    skipped: tuple[str, ...]

    def layouts_of(self, roles: Roles) -> list[TextLayout]:
        """How the tables are written that are used; the settings have room for one way."""
        used = {role.found.pattern for role in (*roles.emg, roles.angle) if role is not None}
        ways: list[TextLayout] = []
        for pattern, layout in self.layouts.items():
            if pattern in used and layout not in ways:
                ways.append(layout)
        return ways


def raw_draft(study: str, folder: Path, files: Sequence[PurePosixPath], choice: Choice) -> Draft:
    """The block of a recorded dataset.

    Args:
        study: its name.
        folder: that the files are in.
        files: recordings, relative to it.
        choice: which arm.

    Raises:
        ValueError: if the names make no two trials, or no signal is EMG, or none is an angle.
    """
    naming, read, roles = _recognised(folder, name_trials(files))
    angle = roles.angle
    if not roles.emg or angle is None:
        missing = " and ".join(["EMG"] * (not roles.emg) + ["angle"] * (angle is None))
        raise ValueError(
            f"{folder}: no {missing} recognised among {len(read.found)} signals in {', '.join(naming.patterns[:6])}; "
            "expected names such as biceps or emg, and elbow, flexion or angle, or units such as uV and deg. Rename "
            "files or columns, or write the block by hand (docs/real_arm.md)." + _because(read.skipped)
        )
    mvc = tuple(name for name in naming.mvc if all(_file(folder, role.found, name).is_file() for role in roles.emg))
    layouts = read.layouts_of(roles)
    study_arm = arm_of(study, [role.name for role in roles.emg], choice)
    lines = [
        "      kind: recorded # raw EMG and angles, processed here",
        f"      trials: {inline_list(naming.trials)} # GUESSED from the names",
        *held_out_lines(naming.trials),
        *([f"      mvc: {inline_list(mvc)} # GUESSED: maximum contractions"] if mvc else []),
        "      emg: # GUESSED, all of it",
        *(line for role in roles.emg for line in _signal_lines(folder, role)),
        "      angle: # GUESSED. FILL IN sign and offset: 0 is the forearm hanging straight, positive in flexion",
        *_angle_lines(folder, angle),
        *_lean_lines(folder, roles.lean),
        *_layout_lines(next(iter(layouts), _PLAIN)),
        *_processing_lines(roles.emg, angle, bool(mvc)),
        *arm_lines(study_arm),
        *conditions_lines(naming.trials),
        *_identify_lines(study_arm.groups, bool(mvc)),
        *(['      ignore_columns: ["*"] # columns that are named nowhere above'] if _has_spare(roles) else []),
    ]
    guessed = tuple(_guessed(naming, roles, angle, mvc, read))
    to_do = [*_to_do(roles, angle, bool(mvc)), *study_arm.to_do]
    if len(layouts) > 1:
        to_do.append(
            "tables of text differ in their rows above the numbers, and layout holds one way: export them alike"
        )
    return Draft("recorded", naming.trials, tuple(lines), guessed, tuple(to_do), study_arm)


def _recognised(folder: Path, namings: Sequence[Naming]) -> tuple[Naming, _Read, Roles]:
    """The first way to name trials by which each has EMG and an angle; the best one where none does.

    `curl1_devices.csv` and `curl1_model.csv` look like two trials until they are read.
    """
    tried = []
    for naming in namings[:_TRIED]:
        read = _read_first(folder, naming)
        roles = guess_roles(read.found)
        if roles.emg and roles.angle:
            return naming, read, roles
        tried.append((naming, read, roles))
    return tried[0]


def _read_first(folder: Path, naming: Naming) -> _Read:
    """Signals of the first trial. A file that cannot be read is skipped, and said."""
    found: list[Found] = []
    skipped = []
    layouts = {}
    for pattern in naming.patterns:
        path = folder / pattern.replace(TRIAL, naming.trials[0])
        try:
            form = format_of(path)
            if form == "csv":
                layout = layout_of(path)
                raw = read_raw(path, form, layout)
                if column := time_column_of(raw.signals):
                    layout = layout.model_copy(update={"time_column": column})
                    raw = read_raw(path, form, layout)
                layouts[pattern] = layout
            else:
                raw = read_raw(path, form)
        except ValueError as error:
            skipped.append(str(error))
            continue
        found += signals_of(pattern, form, raw)
    return _Read(tuple(found), layouts, tuple(skipped))


def _because(skipped: Sequence[str]) -> str:
    return "".join(f"\n{reason}" for reason in skipped[:3])


def _file(folder: Path, found: Found, trial: str) -> Path:
    return folder / found.pattern.replace(TRIAL, trial)


def _has_spare(roles: Roles) -> bool:
    """Whether a file that is used holds signals that are not."""
    read = {role.found.pattern for role in (*roles.emg, roles.angle) if role is not None}
    return any(one.pattern in read for one in roles.unused) or (roles.lean is not None and not roles.lean.found.alone)


def _keys(folder: Path, role: Role) -> Iterator[str]:
    found = role.found
    parts = [glob.escape(part) for part in found.pattern.split(TRIAL)]
    pattern = TRIAL.join(part.replace("{", "?").replace("}", "?") for part in parts)
    yield f"file: {scalar(f'{glob.escape(shown(folder))}/{pattern}')}"
    if not found.alone:
        name = found.signal.name
        yield (
            f"column: {scalar(name)}"
            if is_technical(name)
            else ("column: null # FILL IN its name in the file; it is not copied, as it may hold that of a person")
        )
    if ENDINGS.get(ending_of(PurePosixPath(found.pattern))) != found.form:
        yield f"format: {found.form}"
    if role.unit:
        yield f"unit: {role.unit} # GUESSED: {'its name ends so' if said_by_name(found) else 'the file names none'}"
    if found.rate is None:
        yield "rate_hz: null # FILL IN the samples a second: the file has neither times nor a rate"
    if role.form != "raw":
        yield "form: envelope # GUESSED: it is never below 0"


def _signal_lines(folder: Path, role: Role) -> list[str]:
    return [f"        {role.name}: # {_facts(role)}", *(f"          {key}" for key in _keys(folder, role))]


def _angle_lines(folder: Path, role: Role) -> list[str]:
    low, high = _degrees(role)
    keys = [*_keys(folder, role), f"sign: 1 # {low:.0f} to {high:.0f} deg in the first trial", "offset_deg: 0.0"]
    return [f"        {key}" for key in keys]


def _lean_lines(folder: Path, role: Role | None) -> list[str]:
    if role is None:
        return []
    keys = [*_keys(folder, role), "sign: 1 # FILL IN: forward is positive", "condition: tilt"]
    return [
        "      # GUESSED: the lean of the upper arm. Which way is positive is unknown: correct sign, take the # away.",
        "      # signals:",
        "      #   tilt_rad:",
        *(f"      #     {key}" for key in keys),
    ]


def _layout_lines(layout: TextLayout) -> list[str]:
    keys = [f"{key}: {scalar(getattr(layout, key))}" for key in ("header_row", "units_row", "time_column")
            if getattr(layout, key) != getattr(_PLAIN, key)]  # fmt: skip
    return [f"      layout: {{{', '.join(keys)}}} # GUESSED: how the tables of text are written"] if keys else []


def _processing_lines(emg: Sequence[Role], angle: Role, mvc: bool) -> list[str]:
    keys = []
    slowest = min((r.found.rate for r in emg if r.form == "raw" and r.found.rate), default=None)
    if slowest is not None and _NYQUIST_SHARE * slowest < _TOP_HZ:
        keys.append(f"band_pass_hz: [20, {int(_NYQUIST_SHARE * slowest)}]")
    if angle.found.rate is not None and angle.found.rate > _GRID_HZ:
        keys.append(f"rate_hz: {_GRID_HZ:g}")
    if mvc:
        keys.append("normalise: mvc")
    return [f"      processing: {{{', '.join(keys)}}}"] if keys else []


def _identify_lines(groups: Sequence[str], mvc: bool) -> list[str]:
    """Strengths within wide bounds where nothing says what a full contraction is."""
    if mvc or not groups:
        return []
    lines = ["      identify: # no maximum contraction: a strength holds the unknown gain of its EMG as well"]
    for group in groups:
        lines.append(f"        strength_{group}: {{start_spread: 0.3, low: 0.02, high: 5.0}}")
        lines.append(f"        length_{group}: {{start_spread: 0.05, low: 0.85, high: 1.15}}")
    return lines


def _facts(role: Role) -> str:
    unit = f"{role.unit} (guessed)" if role.unit else role.found.unit
    rate = "unknown rate" if role.found.rate is None else f"{role.found.rate:g} Hz"
    return f"{unit}, {rate}"


def _degrees(role: Role) -> tuple[float, float]:
    values = role.found.signal.values[np.isfinite(role.found.signal.values)]
    if not len(values):
        return 0.0, 0.0
    factor = 180 / np.pi if (role.found.unit or role.unit) == "rad" else 1.0
    return float(values.min() * factor), float(values.max() * factor)


def _guessed(naming: Naming, roles: Roles, angle: Role, mvc: Sequence[str], read: _Read) -> Iterator[str]:
    low, high = _degrees(angle)
    yield f"raw recordings ({', '.join(dict.fromkeys(one.form for one in read.found))})"
    yield f"{len(naming.trials)} trials, each a {TRIAL} below: {', '.join(naming.trials)}"
    for role in roles.emg:
        yield f"{role.name}: {role.found.pattern}, {_facts(role)}" + (", an envelope" if role.form != "raw" else "")
    yield f"angle: {angle.found.pattern}, {_facts(angle)}, {low:.0f} to {high:.0f} deg in {naming.trials[0]}"
    if roles.lean:
        yield f"lean of the upper arm: {roles.lean.found.pattern}; written as a comment, as its sign is not known"
    if mvc:
        yield f"maximum contractions: {', '.join(mvc)}"
    files = sorted({one.pattern for one in roles.unused} - {role.found.pattern for role in (*roles.emg, angle)})
    if files:
        yield f"not used: {', '.join(files)}"
    if naming.left_out:
        more = f" and {len(naming.left_out) - 3} more" if len(naming.left_out) > 3 else ""
        yield f"of no trial: {', '.join(naming.left_out[:3])}{more}"
    for reason in read.skipped:
        yield f"not read: {reason}"


def _to_do(roles: Roles, angle: Role, mvc: bool) -> Iterator[str]:
    low, high = _degrees(angle)
    yield "the mass in the hand in each trial, under conditions"
    if low < _LIKELY_DEG[0] or high > _LIKELY_DEG[1]:
        yield (
            f"the angle goes from {low:.0f} to {high:.0f} deg; 0 has to be the forearm hanging straight, positive in "
            "flexion. Where 180 is straight: sign: -1, offset_deg: 180"
        )
    else:
        yield "check that the angle is 0 with the forearm hanging straight, positive in flexion (sign, offset_deg)"
    used = (*roles.emg, angle)
    if any(not role.found.alone and not is_technical(role.found.signal.name) for role in used):
        yield "names of columns that may hold a person's were not copied: fill in column where it is null"
    if any(role.found.rate is None for role in used):
        yield "samples a second, rate_hz, where the file has neither times nor a rate"
    if not mvc:
        yield "recordings of maximum contractions, under mvc; without any, strengths are known up to a gain"
