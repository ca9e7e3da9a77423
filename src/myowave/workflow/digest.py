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
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import NamedTuple

PACKAGE = Path(__file__).parents[1]
_ROOTS = (PACKAGE.parent,)
# A rule's settings are in its params, and its log is no result.
BESIDE = ("myowave.settings", "myowave.workflow")
CATALOGUE = PACKAGE / "physics/effects/__init__.py"


def digest_script(script: Path, *, roots: tuple[Path, ...] = _ROOTS) -> str:
    """Digest of a Python script and of all of our modules that it imports, from folders that hold our packages."""
    used = {_below(path, roots): path for path in imported_modules(script, roots=roots)} | {script.name: script}
    digest = hashlib.sha256()
    for name in sorted(used):
        digest.update(name.encode())
        digest.update(_read(used[name]).digest.encode())
    return digest.hexdigest()[:16]


def digest_files(paths: Iterable[str | Path]) -> dict[str, str]:
    """Digests of the contents of files, by path; files that are not there are left out."""
    found = {}
    for path in map(Path, paths):
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
    for name in _read(path).imports:
        parts = name.split(".")
        if ".".join(parts[:2]) in BESIDE:
            continue
        for place in (root.joinpath(*parts[:depth]) for root in roots for depth in range(1, len(parts) + 1)):
            found |= {file for file in (place / "__init__.py", place.with_suffix(".py")) if file.is_file()}
    if path == CATALOGUE:
        found |= set(path.parent.glob("[!_]*.py"))
    return frozenset(found)


def _below(file: Path, roots: tuple[Path, ...]) -> str:
    """The path of a file below the first of the roots that holds it."""
    return next(file.relative_to(root).as_posix() for root in roots if file.is_relative_to(root))


class _Read(NamedTuple):
    """What is kept of a file: the digest of its statements, and the dotted names that it imports."""

    digest: str
    imports: list[str]


@cache
def _read(path: Path) -> _Read:
    """Read a file, or what was kept of it beside its byte code, as parsing the whole package takes a second."""
    text = path.read_bytes()
    version = f"{sys.version_info.major}.{sys.version_info.minor}"  # statements are written down differently
    key = hashlib.sha256(version.encode() + _own_code() + text).hexdigest()
    kept = path.parent / "__pycache__" / f"{path.stem}.digest.json"
    with suppress(OSError, ValueError, TypeError):
        content = json.loads(kept.read_bytes())
        if content.pop("key") == key:
            return _Read(**content)
    tree = ast.parse(text, str(path))
    imports = sorted(set(_names_imported(tree)))
    found = _Read(_digest_statements(tree), imports)
    with suppress(OSError):  # a folder that nobody may write to
        kept.parent.mkdir(exist_ok=True)
        draft = kept.with_suffix(f".{os.getpid()}")  # other processes may be reading
        draft.write_text(json.dumps({"key": key, **found._asdict()}))
        draft.replace(kept)
    return found


@cache
def _own_code() -> bytes:
    return Path(__file__).read_bytes()


def _names_imported(tree: ast.Module) -> Iterator[str]:
    """Dotted names that a module imports, inside functions too; the last part may be a name within a module."""
    for node in _statements(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _digest_statements(tree: ast.Module) -> str:
    """Digest of a module's statements without docstrings, which are taken out of the tree."""
    for node in _statements(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            does = [s for s in node.body if not (isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant))]
            node.body = does or [ast.Pass()]
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()


def _statements(tree: ast.Module) -> Iterator[ast.AST]:
    """A module and all its statements, without their expressions, which are many and hold no import or docstring."""
    stack: list[ast.AST] = [tree]
    while stack:
        node = stack.pop()
        for name in ("body", "orelse", "finalbody", "handlers", "cases"):
            block = getattr(node, name, ())
            stack += block if isinstance(block, list) else ()
        yield node
