"""Write the pages of the reference from the code, into docs/reference: `make docs`.

Effects as the catalogue has them, settings as `myowave settings --all` lists them, commands as `--help` tells them.
"""

import inspect
import re
import subprocess
import sys
from itertools import groupby
from pathlib import Path
from typing import Any

import myowave
from myowave.physics.effect import STAGES, Effect
from myowave.physics.effects import catalogue
from myowave.settings import Settings
from myowave.settings.keys import Key, find_keys, list_groups, list_keys

DOCS = Path(__file__).parent
STAGE_MEANS = {
    "constants": "They change constants of the muscles or the forearm.",
    "excitation": "They change what drives each muscle.",
    "activation": "They change how a muscle answers to what drives it.",
    "path": "They change length and moment arm of the muscles.",
    "muscle": "They change the force of the fibres, in units of f0.",
    "inertia": "They add to the moment of inertia [kg m²].",
    "joint": "They add a torque about the elbow [N m].",
    "observation": "They change what the angle's sensor shows [rad].",
}


def effects_page() -> str:
    """Every effect with its equation, parameters and source, in the order of the stages where they act."""
    effects = catalogue().values()
    parts = [
        "# Effects",
        f"What a model of the arm may lack: the {len(effects)} effects that are tried, by where they act. With all "
        "its parameters at 0 an effect changes nothing. `myowave effects` prints the same, and those of your own "
        "files; how to write one stands in [Where do I put ...](../architecture.md).",
    ]
    for stage in STAGES:
        parts += [f"## On {stage}", STAGE_MEANS[stage]]
        parts += [_effect(effect) for effect in effects if effect.acts_on == stage]
    return "\n\n".join(parts) + "\n"


def _effect(effect: Effect) -> str:
    rows = [
        f"| `{name}` | {p.unit} | {p.low:g} to {p.high:g} | {p.typical:g} | "
        f"{p.meaning}{f', one for each {p.each}' if p.each else ''} |"
        for name, p in effect.parameters.items()
    ]
    table = ["| parameter | unit | bounds | typical | meaning |", "|---|---|---|---|---|", *rows]
    lines = [f"({effect.name})=", f"### {effect.name}", "", f"*{effect.title}*"]
    return "\n".join([*lines, "", f"```text\n{effect.equation}\n```", "", *table, "", f"Source: {effect.source}"])


def settings_page() -> str:
    """Every key with unit, default, meaning and allowed values, by group."""
    listed = list_keys(Settings)
    keys, groups = find_keys(listed, []), list_groups(listed)
    parts = [
        "# Settings",
        f"All {sum(count for count, _ in groups.values())} keys of `config.yaml`, as `myowave settings --all` prints "
        "them. `<name>` stands for a name that you choose. Lay your own file over `config.yaml`; "
        "what it does not name stays as it is.",
    ]

    for group, members in groupby(keys, lambda key: key.group):
        title = f"## {group}\n\n{groups[group][1][:1].upper()}{groups[group][1][1:]}." if group in groups else ""
        parts += [title] if title and title not in parts else []
        parts += [_setting(key) for key in members if key.name != group]
    return "\n\n".join(parts) + "\n"


def _setting(key: Key) -> str:
    facts, meaning = key.facts, f"{key.meaning}: {key.allowed}"
    return f"`{key.name}` {_plain(facts)}".rstrip() + f"\n: {_plain(meaning)}"


def _plain(text: str) -> str:
    """Text in which no sign counts as Markdown."""
    return re.sub(r"([\\`*_{}\[\]<>#|])", r"\\\1", text)


def commands_page() -> str:
    """Every command of `myowave`, as its own help tells it, and the targets of `make`."""
    told = subprocess.run(
        [sys.executable, "-m", "typer", "myowave.cli", "utils", "docs", "--name", "myowave"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    targets = re.findall(r"^([\w-]+):.*?## (.*)$", (DOCS.parent / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    rows = [f"| `make {name}` | {meaning} |" for name, meaning in targets]
    return "\n".join(
        ["# Commands", "", told.replace("\n# ", "\n## ").replace("# `myowave`", "## `myowave`", 1).strip(), ""]
        + ["## make", "", "| command | what |", "|---|---|", *rows, ""]
    )


def python_page() -> str:
    """The six lines that a test runs, and what they call."""
    first, _, lines = (myowave.__doc__ or "").partition("\n\n")
    parts = ["# From Python", first.strip(), f"```python\n{lines.strip()}\n```"]
    parts.append(
        "Rules of the workflow call the same functions. Run it in the folder of myowave, or name its `config`."
    )
    for name, function in (("Trials.from_csv", myowave.Trials.from_csv), ("diagnose", myowave.diagnose)):
        parts += [f"## myowave.{name}", f"```python\n{name}{_signature(function)}\n```"]
        parts.append(f"```text\n{inspect.getdoc(function)}\n```")
    parts += ["## What it returns", inspect.getdoc(myowave.Diagnosed) or ""]
    for name in ("verdict", "tables", "page"):
        parts.append(f"`{name}`\n: {_plain(inspect.getdoc(getattr(myowave.Diagnosed, name)) or '')}")
    return "\n\n".join(parts) + "\n"


def _signature(function: Any) -> str:
    """Arguments of a function and their defaults, without types."""
    shown = {"VAR_POSITIONAL": "*", "VAR_KEYWORD": "**"}
    arguments = []
    for p in inspect.signature(function).parameters.values():
        default = "" if p.default is p.empty else "=..." if callable(p.default) else f"={p.default!r}"
        arguments.append(f"{shown.get(p.kind.name, '')}{p.name}{default}")
    return f"({', '.join(arguments)})"


def main() -> None:
    (DOCS / "reference").mkdir(exist_ok=True)
    pages = {"effects": effects_page, "settings": settings_page, "commands": commands_page, "python": python_page}
    for name, page in pages.items():
        (DOCS / "reference" / f"{name}.md").write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
