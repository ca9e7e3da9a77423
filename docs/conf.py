"""Settings of Sphinx, which makes the site from the pages here: `make docs`."""

import re
from pathlib import Path
from typing import Any

project = "myowave"
copyright = "the myowave authors"
extensions = ["myst_parser"]
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "myowave"
exclude_patterns = ["_build", "requirements.txt"]

ROOT = Path(__file__).parents[1]
# Files outside of docs/ that are pages of the site, by the page that is made of them.
FROM_ROOT = {
    "index": "README.md",
    "architecture": "ARCHITECTURE.md",
    "contributing": "CONTRIBUTING.md",
    "changelog": "CHANGELOG.md",
    "configuration": "config/README.md",
}


def take_from_root(app: Any, page: str, source: list[str]) -> None:
    """Put the file that a page is made of before it, with links that lead to pages of the site."""
    if page in FROM_ROOT:
        path = ROOT / FROM_ROOT[page]
        source[0] = path.read_text(encoding="utf-8").replace("](docs/", "](").replace("](../docs/", "](") + source[0]
    source[0] = re.sub(r"(?<!!)\[([^]]*)\]\(((?:\.\./)*[\w./]+)\)", _link, source[0])


def _link(found: re.Match[str]) -> str:
    """A link to a file outside of docs/ as one to its page; as plain text where it has none."""
    text, target = found.groups()
    name = target.removeprefix("../")
    page = next((page for page, file in FROM_ROOT.items() if file == name), None)
    if page:
        return f"[{text}]({page}.md)"
    return found[0] if (ROOT / "docs" / target).exists() or target.startswith("reference/") else text


def setup(app: Any) -> None:
    app.connect("source-read", take_from_root)
