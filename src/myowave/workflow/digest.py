"""Digest of the code that a rule uses, so that a workflow knows when a result is out of date.

It covers the rule's script and every module of the package that the script imports, directly or through others, and no
other: an edit in the network reruns no diagnosis, one in the physics no import of recordings. Comments, layout and
docstrings do not count, as they change no result; neither do the modules of `BESIDE`.
A package that imports modules by name, as the catalogue of effects does, uses all that stand beside it.
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

_PACKAGE = "myowave"
_SOURCE = Path(__file__).parents[1]
# A rule's settings are in its params, and its log is no result.
BESIDE = ("settings", "workflow")


def digest_script(script: Path, *, source: Path = _SOURCE) -> str:
    """Digest of a script and of all that it imports from the package.

    Args:
        script: a Python file.
        source: folder of the package.

    Raises:
        FileNotFoundError: if there is no such script.
        SyntaxError: if one of the files is no Python.
    """
    used = {script} | imported_modules(script, source=source)
    digest = hashlib.sha256()
    for path in sorted(used):
        digest.update((path.relative_to(source).as_posix() if path != script else path.name).encode())
        digest.update(_read(path).digest.encode())
    return digest.hexdigest()[:16]


def digest_module(path: str, *, source: Path = _SOURCE) -> str:
    """As `digest_script`, of a module of the package by its path below it, such as `learning/training.py`."""
    return digest_script(source / path, source=source)


def digest_files(paths: Iterable[str | Path]) -> dict[str, str]:
    """Digests of the contents of files, by path; files that are not there are left out."""
    found = {}
    for path in map(Path, paths):
        with suppress(FileNotFoundError), path.open("rb") as file:
            found[str(path)] = hashlib.file_digest(file, "sha256").hexdigest()[:16]
    return found


def imported_modules(script: Path, *, source: Path = _SOURCE) -> set[Path]:
    """Files of the package that a script imports, directly or through others, without those of `BESIDE`."""
    found: set[Path] = set()
    waiting = [script]
    while waiting:
        for path in _imports_of(waiting.pop(), source) - found:
            found.add(path)
            waiting.append(path)
    return found


@cache
def _imports_of(path: Path, source: Path) -> frozenset[Path]:
    """Files of the package that a file names in its import statements; importing a module runs its packages, too."""
    found: set[Path] = set()
    for name in _read(path).imports:
        package, *parts = name.split(".")
        if package != _PACKAGE or (parts and parts[0] in BESIDE):
            continue
        for depth in range(len(parts) + 1):
            place = source.joinpath(*parts[:depth])
            found |= {file for file in (place / "__init__.py", place.with_suffix(".py")) if file.is_file()}
    if path.name == "__init__.py" and _read(path).by_name:
        found |= set(path.parent.glob("[!_]*.py"))
    return frozenset(found)


class _Read(NamedTuple):
    """What is kept of a file: the digest of its statements, the dotted names that it imports, and whether it calls
    `importlib.import_module`, with which a package may import any module beside it."""

    digest: str
    imports: list[str]
    by_name: bool


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
    by_name = any(isinstance(node, ast.Attribute) and node.attr == "import_module" for node in ast.walk(tree))
    found = _Read(_digest_statements(tree), imports, by_name)
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
            node.body = [s for s in node.body if not _is_docstring(s)] or [ast.Pass()]
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


def _is_docstring(statement: ast.stmt) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )
