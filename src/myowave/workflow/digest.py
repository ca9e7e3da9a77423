"""Digest of the code that a rule uses, so that a workflow knows when a result is out of date.

It covers the rule's script and every module of ours that the script imports, directly or through others, and no other:
an edit in the network reruns no diagnosis, one in the physics no import of recordings. Ours is what lies in the folders
`roots`: of this package, and for a study of the studies as well. Comments, layout and docstrings do not count, as they
change no result; neither do the packages of `BESIDE`.
The catalogue of effects imports its modules by name: it uses all that stand beside it.
"""

import ast
import hashlib
import json
import os
import sys
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[1]
_ROOTS = (PACKAGE.parent,)
# A rule's settings are in its params, and its log is no result.
BESIDE = ("myowave.settings", "myowave.workflow")
CATALOGUE = PACKAGE / "physics/effects/__init__.py"
# What is kept of a file is of one reader: each version of Python, and of this file, writes statements differently.
_READER = f"{sys.version_info[:2]}".encode() + Path(__file__).read_bytes()


def digest_script(script: Path, *, roots: tuple[Path, ...] = _ROOTS) -> str:
    """Digest of a Python script and of all of our modules that it imports, from folders that hold our packages."""
    files = imported_modules(script, roots=roots)
    below = {next(f.relative_to(root).as_posix() for root in roots if f.is_relative_to(root)): f for f in files}
    digest = hashlib.sha256()
    for name, file in sorted((below | {script.name: script}).items()):
        digest.update(name.encode())
        digest.update(_read(file)[0].encode())
    return digest.hexdigest()[:16]


def digest_files(paths: Iterable[str | Path]) -> dict[str, str]:
    """Digests of the contents of files, by path; what is not there, or no file, is left out."""
    found = {}
    for path in filter(Path.is_file, map(Path, paths)):
        with suppress(FileNotFoundError), path.open("rb") as file:
            found[str(path)] = hashlib.file_digest(file, "sha256").hexdigest()[:16]
    return found


def imported_modules(script: Path, *, roots: tuple[Path, ...] = _ROOTS) -> set[Path]:
    """Files of ours that a script imports, directly or through others, without those of `BESIDE`."""
    found: set[Path] = set()
    waiting = [script]
    while waiting:
        for path in _imports_of(waiting.pop(), roots) - found:
            found.add(path)
            waiting.append(path)
    return found


@cache
def _imports_of(path: Path, roots: tuple[Path, ...]) -> frozenset[Path]:
    """Files of ours that a file names in its import statements; importing a module runs its packages, too."""
    found: set[Path] = set()
    for name in _read(path)[1]:
        parts = name.split(".")
        if ".".join(parts[:2]) in BESIDE:
            continue
        for place in (root.joinpath(*parts[:depth]) for root in roots for depth in range(1, len(parts) + 1)):
            found |= {file for file in (place / "__init__.py", place.with_suffix(".py")) if file.is_file()}
    if path == CATALOGUE:
        found |= set(path.parent.glob("[!_]*.py"))
    return frozenset(found)


@cache
def _read(path: Path) -> tuple[str, list[str]]:
    """Digest of a file's statements, and the dotted names that it imports, of which the last part may be a name within
    a module; or what was kept of them beside its byte code, as parsing the whole package takes a second."""
    text = path.read_bytes()
    key = hashlib.sha256(_READER + text).hexdigest()
    kept = path.parent / "__pycache__" / f"{path.stem}.digest.json"
    with suppress(OSError, ValueError, TypeError):
        kept_key, digest, imports = json.loads(kept.read_bytes())
        if kept_key == key:
            return digest, imports
    tree, names = ast.parse(text, str(path)), set[str]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            does = [s for s in node.body if not (isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant))]
            node.body = does or [ast.Pass()]  # without docstrings
    found = hashlib.sha256(ast.dump(tree).encode()).hexdigest(), sorted(names)
    with suppress(OSError):  # a folder that nobody may write to
        kept.parent.mkdir(exist_ok=True)
        draft = kept.with_suffix(f".{os.getpid()}")  # other processes may be reading
        draft.write_text(json.dumps([key, *found]))
        draft.replace(kept)
    return found
