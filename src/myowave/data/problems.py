"""Problems of many files that are one mistake, such as a wrong name of a column, said once."""

import re
from collections import Counter
from collections.abc import Iterable

_NUMBER = re.compile(r"(?<!\w)[-+]?\d[\d.,]*(e[-+]?\d+)?(?!\w)")
_LISTED = 8  # places that are listed


def say_once(problems: Iterable[str]) -> list[str]:
    """Problems that begin with where they are, as `trial2.csv, row 118: ...`: of those that differ in nothing but that
    and numbers the first, and where it is so as well."""
    seen: Counter[tuple[str, str]] = Counter()
    alike: dict[tuple[str, int], list[str]] = {}
    for problem in problems:
        where, _, what = problem.partition(": ")
        place = where.partition(", ")[0]
        kind = _NUMBER.sub("", what.replace(place, "")) if what and "; " not in where else problem
        seen[place, kind] += 1  # EMG 1 and EMG 2 of one file are two
        alike.setdefault((kind, seen[place, kind]), [problem]).append(where)
    return [first + _likewise(more) for first, _, *more in alike.values()]


def _likewise(places: list[str]) -> str:
    others = f" and {len(places) - _LISTED} others" if len(places) > _LISTED else ""
    return f" Likewise in {len(places)} more: {'; '.join(places[:_LISTED])}{others}." if places else ""
