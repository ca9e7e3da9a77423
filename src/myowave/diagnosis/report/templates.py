"""Pages from the templates that stand with the workflow's captions, styles and scripts inside; effects and muscles go
by what people call them there, and terms of words.j2 are explained on hover."""

import re
import subprocess
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup, escape

from myowave.diagnosis.report.numbers import degrees, estimate, r2_text, signed, two_digits

PAGES = Path(__file__).parents[4] / "workflow/report"


def fill(template: str, titles: Mapping[str, str], content: Mapping[str, Any]) -> str:
    """A page as HTML that needs nothing else, with date, version and commit, by the name of its template and titles of
    effects. What is in the template's folder can be included, as it is with `asset(name)`; every text that comes from
    data is escaped."""

    def asset(name: str) -> Markup:
        return Markup((PAGES / name).read_text(encoding="utf-8"))

    made = f"{datetime.now(UTC):%Y-%m-%d}, myowave {version('myowave')}{_commit()}"
    marked = {function.__name__: partial(function, titles=titles) for function in (explained, titled, described)}
    return templates().get_template(template).render(asset=asset, made=made, **marked, **content)


@cache
def templates() -> jinja2.Environment:
    """All of them; text of data is escaped in those of HTML."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(PAGES),
        autoescape=jinja2.select_autoescape(["html", "html.j2"]),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    environment.policies["json.dumps_kwargs"] = {"sort_keys": True, "separators": (",", ":"), "allow_nan": False}
    environment.filters |= {"deg": degrees, "two": two_digits, "r2": r2_text, "estimate": estimate, "unit": with_unit}
    environment.filters |= {"muscles": of_muscles, "signed": signed, "listed": listed}
    return environment


@cache
def words(table: str) -> Mapping[str, str]:
    """A table of words.j2: `glossary`, what terms mean; `written`, how; or `muscles`, what people call them."""
    found: Mapping[str, str] = getattr(templates().get_template("words.j2").module, table)
    return found


def of_muscles(text: str) -> str:
    """A text in which muscles go by what people call them; one that no table knows keeps its name."""
    return re.sub(rf"\b({'|'.join(words('muscles'))})\b", lambda match: words("muscles")[match[0]], text)


def called(effect: str, titles: Mapping[str, str]) -> str:
    """What people call an effect; its words where it was not weighed."""
    return titles.get(effect) or effect.replace("_", " ")


def described(model: str, titles: Mapping[str, str]) -> str:
    """A model by what it has, and a network by its source and model, such as `network, rollout, 1-scale, base+fatigue`;
    any other predictor as it is."""
    source, _, name = model.rpartition(", ")
    base, *effects = name.split("+")
    has = " with " * bool(effects) + listed([called(effect, titles) for effect in effects])
    return (source or titles.get("base", "muscle model")) + has if base == "base" else model


def listed(parts: Sequence[str], before_last: str = " and ") -> str:
    """One text of all: "A, B and C"."""
    return before_last.join(filter(None, (", ".join(parts[:-1]), *parts[-1:])))


def paragraphs(text: str) -> list[str]:
    """The paragraphs of a filled template of sentences, each in one line; no space stands before a full stop."""
    lines = [" ".join(part.split()) for part in text.split("<p>")]
    return [re.sub(r" (?=[.,;:](?: |$))", "", line) for line in lines if line]


def with_unit(unit: str) -> str:
    """A unit behind its number; nothing for a number without one."""
    return "" if unit in ("-", "") else f" {unit}"


def explained(text: str, titles: Mapping[str, str]) -> Markup:
    """A text as HTML: effects with their titles, terms with their meaning on hover, each where it first stands. Names
    within models, such as base+joint_damping, are left alone."""
    names = "|".join(sorted(map(re.escape, {*titles} - {"base"}), key=len, reverse=True)) or "$^"
    glossary, written = words("glossary"), words("written")
    terms = "|".join(rf"(?P<t{i}>{written.get(term, term)})" for i, term in enumerate(glossary))
    pattern = rf"(?<![\w+./])(?:(?P<effect>{names})(?![\w+/]|\.\w)|(?:{terms})(?!\w))"
    seen: set[str] = set()

    def mark(match: re.Match[str]) -> str:
        group, found = str(match.lastgroup), match[0]
        term = found if group == "effect" else list(glossary)[int(group[1:])]
        first = term not in seen
        seen.add(term)
        if group == "effect":
            return str(titled(found, titles)) if first else f"<code>{found}</code>"
        return f'<abbr tabindex="0" title="{escape(glossary[term])}">{found}</abbr>' if first else found

    return Markup(re.sub(pattern, mark, str(escape(text))))


def titled(effect: str, titles: Mapping[str, str]) -> Markup:
    """An effect by its title, with the name that settings and models know it by."""
    name = Markup("<code>{}</code>").format(effect)
    return Markup("{} ({})").format(titles[effect], name) if titles.get(effect) else name


@cache
def _commit() -> str:
    """The commit of this code, marked where it was changed since; empty where it is no checkout."""
    describe = ("describe", "--always", "--dirty=, changed since", "--exclude=*")
    command = ["git", "-C", str(Path(__file__).parent), *describe]
    try:
        return ", commit " + subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""
