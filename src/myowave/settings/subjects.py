"""Many subjects from one table, CSV with commas or semicolons: each row becomes a measured dataset.

Columns: `subject`, its name; `files`, a pattern such as data/s01/*.csv; `test`, names of the test trials, separated by
spaces; `arm`, which may be left out or empty, one of physics.arms; every further column is a known constant of the
subject in SI units, such as `mass` or `l1_Bi`, or, named `{trial}.{constant}`, one that differs between trials, such as
`trial4.load`. An empty cell is not known. `angle.sign` and `angle.offset_deg` are those of a dataset's `angle`.

Where the arm's forearm is a rigid body (`arm26`), `body_mass` [kg], `height` [m] and `sex` (f or m) together stand for
its `mass`, `com`, `inertia` and `grip`, by published tables; a column of these names counts more.
"""

import csv
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from myowave.physics.anthropometry import forearm_with_hand

WORD = "subjects"  # in targets, stands for all subjects of the table
_NEEDED = ("subject", "files", "test")
_BODY = ("body_mass", "height", "sex")


def add_subjects(config: Mapping[str, Any]) -> dict[str, Any]:
    """A parsed config.yaml with the datasets of `data.subjects` in it, and `subjects` in the targets replaced by them.
    A ValueError if the table cannot be read, or a subject is named twice or as another dataset is."""
    data, targets = config.get("data"), config.get("targets")
    if not isinstance(data, Mapping) or not isinstance(table := data.get("subjects"), str):
        return dict(config)
    datasets = data.get("datasets") or {}
    if not isinstance(datasets, Mapping) or not isinstance(targets, Mapping):
        return dict(config)  # what is no section is for the settings to refuse
    subjects = read_subjects(Path(table))
    if both := sorted(set(subjects) & set(datasets)):
        raise ValueError(f"data.subjects: {', '.join(both)} in {table} is also in data.datasets; rename one.")
    named = {key: _for_all(value, [*subjects]) for key, value in targets.items()}
    return {**config, "targets": named, "data": {**data, "subjects": None, "datasets": {**datasets, **subjects}}}


def _for_all(value: Any, subjects: list[str]) -> Any:
    """A list, or a mapping by dataset, with the names of all subjects where it says `subjects`."""
    if isinstance(value, list):
        return [name for entry in value for name in (subjects if entry == WORD else [entry])]
    if isinstance(value, Mapping):
        return {name: of for entry, of in value.items() for name in (subjects if entry == WORD else [entry])}
    return value


def read_subjects(path: Path) -> dict[str, dict[str, Any]]:
    """Sections of `data.datasets`, by subject, from a table; a ValueError names the row and column that is wrong."""
    if not path.is_file():
        raise ValueError(f"data.subjects: there is no table {path}, looked up from {Path.cwd()}.")
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
        table = csv.DictReader(lines, strict=True, delimiter=";" if ";" in "".join(lines[:1]) else ",")
        rows = [(table.line_num, row) for row in table]
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"data.subjects: {path} is not a CSV table in UTF-8 ({error}). Save it as such.") from None
    if twice := [name for name, count in Counter(table.fieldnames or ()).items() if name and count > 1]:
        raise ValueError(f"{path}, row 1: column {', '.join(twice)} is there more than once; keep one of each.")
    subjects: dict[str, dict[str, Any]] = {}
    for number, row in rows:
        where = f"{path}, row {number}"
        if None in row:
            raise ValueError(f"{where}: more cells than columns; quote cells that hold a comma.")
        cells = {column: cell.strip() for column, cell in row.items() if (cell or "").strip()}
        if empty := [name for name in _NEEDED if name not in cells]:
            raise ValueError(f"{where}: nothing in column {', '.join(empty)}; a subject needs {', '.join(_NEEDED)}.")
        if (name := cells["subject"]) in subjects:
            raise ValueError(f"{where}: subject {name!r} is there already; a subject has one row.")
        subjects[name] = _dataset(cells, where)
    return subjects


def _dataset(cells: Mapping[str, str], where: str) -> dict[str, Any]:
    """A dataset from the cells of a row that are not empty, by column."""
    constants, angle = _forearm(cells, where), dict[str, float]()
    conditions: dict[str, dict[str, float]] = {}
    for column in cells:
        if column not in (*_NEEDED, *_BODY, "arm"):
            trial, _, constant = column.rpartition(".")
            known = angle if trial == "angle" else conditions.setdefault(trial, {}) if trial else constants
            known[constant] = _number(cells, column, where)
    dataset: dict[str, Any] = {"kind": "measured", "files": [cells["files"]], "test": cells["test"].split()}
    dataset |= {"arm": cells["arm"]} if "arm" in cells else {}
    dataset |= {"angle": angle} if angle else {}
    return dataset | {"constants": constants, "conditions": conditions}


def _forearm(cells: Mapping[str, str], where: str) -> dict[str, float]:
    """Constants of the forearm, where the row has the body's measures."""
    given = [name for name in _BODY if name in cells]
    if not given:
        return {}
    if missing := [name for name in _BODY if name not in cells]:
        raise ValueError(f"{where}: {', '.join(given)} without {', '.join(missing)}; fill in all three, or none.")
    mass, height = (_number(cells, name, where) for name in _BODY[:2])
    try:
        return {name: estimate.value for name, estimate in forearm_with_hand(mass, height, cells["sex"]).items()}
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None


def _number(cells: Mapping[str, str], column: str, where: str) -> float:
    try:
        return float(cells[column])
    except ValueError:
        found = f"{where}, column {column}: {cells[column]!r} is not a number"
        raise ValueError(f"{found}; give it in SI units, with a decimal point, or leave the cell empty.") from None
