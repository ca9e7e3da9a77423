"""Pages from the templates that stand with the workflow's captions, styles and scripts inside."""

import subprocess
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup


def fill(template: Path, content: Mapping[str, Any]) -> str:
    """A page as HTML that needs nothing else, with date, version and commit; every text that comes from data is
    escaped.

    Args:
        template: a Jinja template; what stands in its folder can be included, as it is with `asset(name)`.
        content: what the template names.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(template.parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {"sort_keys": True, "separators": (",", ":"), "allow_nan": False}

    def asset(name: str) -> Markup:
        return Markup((template.parent / name).read_text(encoding="utf-8"))

    made = f"{datetime.now(UTC):%Y-%m-%d}, myowave {version('myowave')}{_commit()}"
    return environment.get_template(template.name).render(asset=asset, made=made, **content)


@cache
def _commit() -> str:
    """The commit of this code, marked where it was changed since; empty where it is no checkout."""
    command = [
        "git",
        "-C",
        str(Path(__file__).parent),
        "describe",
        "--always",
        "--dirty=, changed since",
        "--exclude=*",
    ]
    try:
        return ", commit " + subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""
