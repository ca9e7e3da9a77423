"""The digest of a rule's code covers what its script imports, and nothing else.

Most tests make up a package of a few lines, change one file, and compare the digests of the same script.
"""

import itertools
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from project_copy import ROOT

from myowave.workflow.digest import digest_files, digest_script, imported_modules

SCRIPT = """from myowave.near import fit
from myowave.settings import SETTING

fit.fit(SETTING)
"""
PACKAGE = {
    "__init__.py": "",
    "near/__init__.py": "NEAR = 1",
    "near/fit.py": "import myowave.far.solve as solver\n\ndef fit(x):\n    return solver.solve(x)",
    "far/__init__.py": "FAR = 1",
    "far/solve.py": "def solve(x):\n    if x:\n        from myowave.late import rarely\n\n    return x + 1",
    "late/__init__.py": "",
    "late/rarely.py": "LATE = 1",
    "near/other.py": "OTHER = 1",
    "unrelated.py": "UNRELATED = 1",
    "settings/__init__.py": "SETTING = 1",
    "workflow/__init__.py": "LOG = 1",
}
DigestOf = Callable[..., str]


@pytest.fixture
def digest_of(tmp_path: Path) -> DigestOf:
    """Digest of a script over the package above; files given by name have other text."""
    count = itertools.count()

    def digest(script: str = SCRIPT, **changed: str) -> str:
        folder = tmp_path / str(next(count))
        others = {f"{name.replace('__', '/', 1)}.py": text for name, text in changed.items()}
        for name, text in (PACKAGE | others).items():
            path = folder / "myowave" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        (folder / "script.py").write_text(script)
        return digest_script(folder / "script.py", roots=(folder,))

    return digest


def test_the_same_code_in_another_folder_has_the_same_digest(digest_of):
    assert digest_of() == digest_of()


@pytest.mark.parametrize(
    "changed",
    [
        {"script": SCRIPT + "fit.fit(2)\n"},
        {"near__fit": "import myowave.far.solve as solver\n\ndef fit(x):\n    return 2 * solver.solve(x)"},
        {"far__solve": PACKAGE["far/solve.py"].replace("x + 1", "x + 2")},
        {"late__rarely": "LATE = 2"},
        {"near____init__": "NEAR = 2"},
        {"far____init__": "FAR = 2"},
    ],
    ids=["script", "direct import", "indirect import", "import in a function", "its package", "package of an import"],
)
def test_what_a_script_uses_counts(digest_of, changed):
    assert digest_of(**changed) != digest_of()


@pytest.mark.parametrize(
    "changed",
    [
        {"unrelated": "UNRELATED = 2"},
        {"near__other": "OTHER = 2"},
        {"settings____init__": "SETTING = 2"},
        {"workflow____init__": "LOG = 2"},
    ],
    ids=["another module", "another module of the same package", "settings", "log"],
)
def test_what_it_does_not_use_does_not_count(digest_of, changed):
    assert digest_of(**changed) == digest_of()


@pytest.mark.parametrize(
    ("plain", "described"),
    [
        ("LATE = 1", '"""About the module."""\n\nLATE = 1  # a comment'),
        ("def f(x):\n    return x", 'def f(x):\n    """About\n\n    x."""\n    return (\n        x\n    )'),
        ("class A:\n    def f(self): ...", 'class A:\n    """A."""\n\n    def f(self):\n        """f."""\n        ...'),
        ("if X:\n    def f(x): pass", 'if X:\n    def f(x):\n        """f."""'),
    ],
    ids=["module", "function", "class and method", "function under a condition"],
)
def test_comments_layout_and_docstrings_do_not_count(digest_of, plain, described):
    assert digest_of(late__rarely=described) == digest_of(late__rarely=plain)


def test_text_that_is_no_docstring_counts(digest_of):
    assert digest_of(late__rarely="X = 'a'") != digest_of(late__rarely="X = 'b'")


def test_an_edit_is_seen_although_what_was_read_before_is_kept(tmp_path):
    script = tmp_path / "script.py"
    code = "import pathlib, sys, myowave.workflow.digest as d; print(d.digest_script(pathlib.Path(sys.argv[1])))"
    found = []
    for text in ("X = 1", "X = 1", "X = 2"):  # each time a process of its own, as the workflow is
        script.write_text(text)
        done = subprocess.run([sys.executable, "-c", code, script], check=True, capture_output=True, text=True)
        found.append(done.stdout)
    assert found[0] == found[1] != found[2]


@pytest.mark.parametrize(
    ("script", "uses", "does_without"),
    [
        (
            "import_trials",
            {"data", "physics/path.py"},
            {"physics/model.py", "physics/effects", "identification", "learning"},
        ),
        ("decompose_scales", {"data"}, {"physics", "identification", "learning", "diagnosis"}),
        ("simulate_trials", {"physics", "data"}, {"identification", "learning", "diagnosis"}),
        ("train_scale", {"physics", "data", "identification", "learning"}, {"diagnosis", "plotting.py"}),
        ("train_scale", {"learning"}, {"learning/sweep", "learning/streaming"}),
        ("evaluate_model", {"data", "learning"}, {"physics/effects", "diagnosis", "learning/sweep", "plotting.py"}),
        ("diagnose_dataset", {"physics", "data", "identification", "diagnosis"}, {"learning", "plotting.py"}),
        ("diagnose_dataset", {"diagnosis"}, {"diagnosis/report/figures.py"}),
        ("watch_ladder", {"diagnosis/report"}, {"physics", "learning", "diagnosis/search"}),
        ("tell_verdict", {"diagnosis/report"}, {"physics", "learning", "diagnosis/search"}),
        ("list_datasets", {"diagnosis/report"}, {"physics", "learning", "diagnosis/search"}),
        ("publish_runs", {"tracking"}, {"physics", "diagnosis/search", "learning/training.py"}),
    ],
)
def test_a_rule_stands_on_what_it_needs_and_no_more(script, uses, does_without):
    used = imported_modules(ROOT / "workflow/scripts" / f"{script}.py")
    names = [path.relative_to(ROOT / "src/myowave").as_posix() for path in used]
    parts = {"/".join(name.split("/")[:depth]) for name in names for depth in range(1, name.count("/") + 2)}
    assert uses <= parts
    assert not does_without & parts


def test_what_is_no_file_has_no_digest(tmp_path):
    """Rules ask for digests of files before any job could say what is wrong with them."""
    (there := tmp_path / "there.csv").write_text("1")
    assert list(digest_files([there, tmp_path, tmp_path / "not_there.csv", there / "below.csv"])) == [str(there)]
