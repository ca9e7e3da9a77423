"""Many subjects from one table: each row becomes a measured dataset.

Columns: `subject`, its name; `files`, a pattern such as data/s01/*.csv; `test`, names of the test trials, separated by
spaces; `arm`, which may be left out or empty, one of physics.arms; every further column is a known constant of the
subject in SI units, such as `mass` or `l1_Bi`, or, named `{trial}.{constant}`, one that differs between trials, such as
`trial4.load`. An empty cell is not known.

Where the arm's forearm is a rigid body (`arm26`), `body_mass` [kg], `height` [m] and `sex` (f or m) together stand for
its `mass`, `com`, `inertia` and `grip`, by published tables; a column of these names counts more.
"""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from myowave.physics.anthropometry import forearm_with_hand

WORD = "subjects"  # in targets, stands for all subjects of the table
_NAMED, _ARM = ("subject", "files", "test"), "arm"
_BODY = ("body_mass", "height", "sex")


def add_subjects(config: Mapping[str, Any]) -> dict[str, Any]:
    """A parsed config.yaml with the datasets of `data.subjects` in it, and `subjects` in the targets replaced by them.

    Raises:
        ValueError: if the table cannot be read, or a subject is named twice or as another dataset is.
    """
    data, targets = config.get("data"), config.get("targets") or {}
    if not isinstance(data, Mapping) or not isinstance(table := data.get("subjects"), str):
        return dict(config)  # what is no section or no path is for the settings to refuse
    subjects = read_subjects(Path(table))
    datasets = data.get("datasets") or {}
    if not isinstance(datasets, Mapping) or not isinstance(targets, Mapping):
        return dict(config)
    if both := sorted(set(subjects) & set(datasets)):
        raise ValueError(f"data.subjects: {', '.join(both)} in {table} is also in data.datasets; rename one.")
    targets = dict(targets)
    for key in ("datasets", "without_networks", "follow_verdict"):
        if isinstance(targets.get(key), list):
            targets[key] = [name for entry in targets[key] for name in (subjects if entry == WORD else [entry])]
    if isinstance(models := targets.get("models"), Mapping) and (for_all := models.get(WORD)):
        others = {name: value for name, value in models.items() if name != WORD}
        targets["models"] = others | dict.fromkeys(subjects, for_all)
    return {**config, "targets": targets, "data": {**data, "subjects": None, "datasets": {**datasets, **subjects}}}


def read_subjects(path: Path) -> dict[str, dict[str, Any]]:
    """Sections of `data.datasets`, by subject, from a table.

    Raises:
        ValueError: naming the row and column that is wrong.
    """
    if not path.is_file():
        raise ValueError(f"data.subjects: there is no table {path}, looked up from {Path.cwd()}.")
    try:
        return _read_rows(path)
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"data.subjects: {path} is not a CSV table in UTF-8 ({error}). Save it as such.") from None


def _read_rows(path: Path) -> dict[str, dict[str, Any]]:
    with path.open(newline="", encoding="utf-8-sig") as file:
        reader = csv.DictReader(file, strict=True)
        if missing := [name for name in _NAMED if name not in (reader.fieldnames or ())]:
            raise ValueError(f"{path}: column {', '.join(missing)} is missing; found {reader.fieldnames}.")
        subjects: dict[str, dict[str, Any]] = {}
        for row in reader:
            where = f"{path}, row {reader.line_num}"
            if empty := [name for name in _NAMED if not (row[name] or "").strip()]:
                raise ValueError(f"{where}: {', '.join(empty)} is empty; every subject needs {', '.join(_NAMED)}.")
            if row["subject"] in subjects:
                raise ValueError(f"{where}: subject {row['subject']!r} is there already; a subject has one row.")
            subjects[row["subject"]] = _dataset(row, where)
    return subjects


def _dataset(row: Mapping[str, str], where: str) -> dict[str, Any]:
    constants = _forearm(row, where)
    conditions: dict[str, dict[str, float]] = {}
    for column, cell in row.items():
        if column in (*_NAMED, _ARM, *_BODY) or not cell:
            continue
        if column is None:
            raise ValueError(f"{where}: more cells than columns; quote cells that hold a comma.")
        trial, _, constant = column.rpartition(".")
        known = conditions.setdefault(trial, {}) if trial else constants
        known[constant] = _number(cell, f"{where}, column {column}")
    test = row["test"].split()
    return ({_ARM: row[_ARM]} if row.get(_ARM) else {}) | {
        "kind": "measured",
        "files": [row["files"]],
        "test": test,
        "constants": constants,
        "conditions": conditions,
    }


def _forearm(row: Mapping[str, str], where: str) -> dict[str, float]:
    """Constants of the forearm, where the row has the body's measures."""
    given = [name for name in _BODY if row.get(name)]
    if not given:
        return {}
    if missing := [name for name in _BODY if name not in given]:
        raise ValueError(f"{where}: {', '.join(given)} without {', '.join(missing)}; fill in all three, or none.")
    mass, height = (_number(row[name], f"{where}, column {name}") for name in _BODY[:2])
    try:
        return {name: estimate.value for name, estimate in forearm_with_hand(mass, height, row["sex"]).items()}
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None


def _number(cell: str, where: str) -> float:
    try:
        return float(cell)
    except ValueError:
        raise ValueError(f"{where}: {cell!r} is not a number; give it in SI units, or leave the cell empty.") from None
