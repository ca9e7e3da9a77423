"""README and the pages of docs/ are short, name what is there, and hold the numbers that a command wrote."""

import importlib.util
import json
import re
import subprocess
from pathlib import Path
from textwrap import dedent

import pytest
import yaml

from myowave.physics.effects import SHIPPED
from myowave.settings import Settings, parse_settings
from myowave.settings.files import lay_over
from myowave.settings.keys import list_keys

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "ARCHITECTURE.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
PAGES += [ROOT / "config/README.md", ROOT / "results/README.md", *sorted((ROOT / "docs").glob("*.md"))]


def script(name):
    """A script of docs/, which is no package."""
    specification = importlib.util.spec_from_file_location(name, ROOT / f"docs/{name}.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


measured, reference = script("measured"), script("reference")


@pytest.mark.parametrize(
    ("page", "lines", "words"), [("README.md", 130, 1200), ("ARCHITECTURE.md", 70, 1200), ("CHANGELOG.md", 30, 200)]
)
def test_a_page_that_everybody_reads_is_short(page, lines, words):
    text = (ROOT / page).read_text(encoding="utf-8")
    assert len(text.splitlines()) <= lines and len(text.split()) <= words


@pytest.mark.parametrize("page", measured.pages(), ids=lambda page: page.name)
def test_numbers_are_those_that_the_main_job_measured(page):
    """`make readme` writes them; nobody does by hand."""
    numbers = json.loads(measured.NUMBERS.read_text(encoding="utf-8"))
    text = page.read_text(encoding="utf-8")
    assert measured.filled(text, measured.blocks(numbers)) == text


def test_every_block_of_numbers_is_shown_somewhere():
    numbers = json.loads(measured.NUMBERS.read_text(encoding="utf-8"))
    shown = {name for page in measured.pages() for _, name, _ in measured.BLOCK.findall(page.read_text())}
    assert shown == set(measured.blocks(numbers))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_to_files(page):
    targets = re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8"))
    lost = [t for t in targets if "://" not in t and not (page.parent / t).exists() and not t.startswith("reference/")]
    assert not lost


@pytest.mark.parametrize("page", ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"])
def test_paths_in_code_style_are_there(page):
    """Such as `tests/faults/faults.yaml` and `data/store`, a module; not results and settings."""
    text = (ROOT / page).read_text(encoding="utf-8")
    paths = {p.rstrip("/") for p in re.findall(r"`(\w+/[\w./-]*)`", text) if not p.startswith("results/")}
    known = {
        p
        for p in paths
        for ending in ("", ".py")
        for folder in ("", "src/myowave", "src/myowave/diagnosis")
        if (ROOT / folder / f"{p}{ending}").exists()
    }
    assert paths == known


def test_make_targets_that_pages_name_are_there():
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = {name for page in PAGES for name in re.findall(r"`make ([\w-]+)", page.read_text(encoding="utf-8"))}
    assert named <= targets


def test_every_page_is_in_the_contents_of_the_site():
    contents = re.findall(r"^(?:.*<)?([\w/]+)>?$", (ROOT / "docs/index.md").read_text(), re.MULTILINE)
    pages = {path.stem for path in (ROOT / "docs").glob("*.md")} - {"index"}
    assert pages == {name for name in contents if "/" not in name}


def test_the_reference_has_every_effect_with_its_equation_and_source():
    page = reference.effects_page()
    for effect in SHIPPED:
        _, _, after = page.partition(f"### {effect.name}\n")
        part = after.partition("\n### ")[0]
        assert effect.equation in part and effect.source in part
        assert all(f"| `{name}` | {p.unit} |" in part for name, p in effect.parameters.items())


def test_the_reference_has_every_setting():
    page = reference.settings_page()
    groups = re.findall(r"^## (.*)$", page, re.MULTILINE)
    names = {key.name for key in list_keys(Settings)}
    assert {name for name in names if f"`{name}`" not in page} <= set(groups)


def test_the_reference_has_every_command_and_target_of_make():
    page = reference.commands_page()
    for command in ("new", "settings", "effects", "predict", "subject", "geometry", "ui"):
        assert f"## `myowave {command}`" in page
    assert "| `make docs` |" in page and "| `make run` |" in page


def test_the_reference_shows_the_lines_that_a_test_runs():
    page = reference.python_page()
    assert "```python\nimport myowave\n\ntrials = " in page and "## myowave.diagnose" in page


def test_the_packages_for_the_site_do_not_change_the_environment():
    pinned = re.findall(r"^([\w.-]+)==", (ROOT / "docs/requirements.txt").read_text(), re.MULTILINE)
    locked = re.findall(r"^([\w.-]+)==", (ROOT / "environment.lock").read_text(), re.MULTILINE)
    assert "sphinx" in pinned and not set(pinned) & set(locked)


def test_no_page_that_is_made_is_in_git():
    listed = subprocess.run(["git", "ls-files", "docs"], cwd=ROOT, capture_output=True, text=True).stdout.split()
    assert not [path for path in listed if path.startswith(("docs/_build", "docs/reference/"))]


def test_the_settings_in_readme_are_settings():
    """Laid over config.yaml, as its reader will."""
    blocks = re.findall(
        r"^    targets:.*\n(?:^    .*\n)+", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    (mine,) = (yaml.safe_load(dedent(block)) for block in blocks)
    base = yaml.safe_load((ROOT / "config.yaml").read_text(encoding="utf-8"))
    settings = parse_settings(lay_over(base, mine))
    assert list(settings.targets.without_networks) == ["me"] and "me" in settings.data.datasets
