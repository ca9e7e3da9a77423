"""Pages from the templates that stand with the workflow's captions, styles and scripts inside."""

import re
import subprocess
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from myowave.diagnosis.report.numbers import degrees, estimate, r2_text, two_digits

PAGES = Path(__file__).parents[4] / "workflow/report"


def fill(template: Path, content: Mapping[str, Any]) -> str:
    """A page as HTML that needs nothing else, with date, version and commit; every text that comes from data is
    escaped.

    Args:
        template: a Jinja template; what stands in its folder can be included, as it is with `asset(name)`.
    """

    def asset(name: str) -> Markup:
        return Markup((template.parent / name).read_text(encoding="utf-8"))

    made = f"{datetime.now(UTC):%Y-%m-%d}, myowave {version('myowave')}{_commit()}"
    return templates_in(template.parent).get_template(template.name).render(asset=asset, made=made, **content)


def templates_in(folder: Path) -> jinja2.Environment:
    """The templates of a folder; text of data is escaped in those of HTML."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder),
        autoescape=jinja2.select_autoescape(["html", "html.j2"]),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {"sort_keys": True, "separators": (",", ":"), "allow_nan": False}
    environment.filters |= {"deg": degrees, "two": two_digits, "r2": r2_text, "estimate": estimate, "unit": with_unit}
    return environment


def paragraphs(text: str) -> list[str]:
    """The paragraphs of a filled template of sentences, each in one line; no space stands before a full stop."""
    lines = [" ".join(part.split()) for part in text.split("<p>")]
    return [re.sub(r" (?=[.,;:](?: |$))", "", line) for line in lines if line]


def with_unit(unit: str) -> str:
    """A unit behind its number; nothing for a number without one."""
    return "" if unit in ("-", "") else f" {unit}"


@cache
def _commit() -> str:
    """The commit of this code, marked where it was changed since; empty where it is no checkout."""
    describe = ("describe", "--always", "--dirty=, changed since", "--exclude=*")
    command = ["git", "-C", str(Path(__file__).parent), *describe]
    try:
        return ", commit " + subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""
