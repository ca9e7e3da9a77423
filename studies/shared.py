"""What studies share: a section of the settings of their own, words for grades, and tables of Markdown."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar

from pydantic import ValidationError

from myowave.settings import Section, Settings
from myowave.settings.keys import explain

# What pages call the grade of an answer.
GRADES = {"right": "right", "class": "class", "honest": "left open", "silent": "missed", "wrong": "wrong"}


class StudySection(Section):
    """Settings of a study, checked like any others, and against those of the core."""

    def problems(self, settings: Settings) -> list[str]:
        """What does not fit the settings of the core, one line each, with the key below the section."""
        raise NotImplementedError


S = TypeVar("S", bound=StudySection)


def read_section(kind: type[S], name: str, values: Mapping[str, Any], settings: Settings) -> S:
    """The section of a study.

    Raises:
        ValueError: one line per problem, each with the key, what was found and what is allowed.
    """
    try:
        section = kind.model_validate(values)
    except ValidationError as error:
        problems = explain(error, kind)
    else:
        problems = section.problems(settings)
        if not problems:
            return section
    raise ValueError("\n".join(f"{name}.{problem}" for problem in problems))


def markdown(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table."""
    return "\n".join(f"| {' | '.join(cells)} |" for cells in [heads, ["---"] * len(heads), *rows])
