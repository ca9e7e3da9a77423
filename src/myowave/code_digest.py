"""Digest of what the code does, so that a workflow knows when a result is out of date.

The layers stand on one another, so a layer's digest covers those before it. On a layer grow branches, such as the sweep
on learning: they use the layer, nothing in a layer uses them, so they count only where they are asked for. Comments,
layout and docstrings do not count: they change no result. Modules called `figures.py` and `page.py`, and those in a
folder `figures`, show results and make none, so they count only for drawing.
"""

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

SHOWING, FOLDER_OF_FIGURES = ("figures.py", "page.py"), "figures"
LAYERS = ("physics", "data", "learning", "diagnosis")
BRANCHES = (
    "learning/sweep", "learning/paper", "learning/streaming.py", "diagnosis/study.py", "diagnosis/subjects",
)  # fmt: skip
_SOURCE = Path(__file__).parent


def digest_layers(last: str, *, drawing: bool = False, source: Path = _SOURCE) -> str:
    """Digest of a layer and all layers before it.

    Args:
        last: one of `LAYERS`, or what is asked for of a branch beside them: its path, or that of a module in it.
        drawing: whether the modules that draw count.
        source: folder of the package.

    Raises:
        ValueError: if there is no such layer or branch.
    """
    layer, _, branch = last.partition("/")
    if layer not in LAYERS or (branch and not is_branch(last)) or not (source / last).exists():
        raise ValueError(f"{last!r} is no layer or branch of {source}; they are {', '.join((*LAYERS, *BRANCHES))}.")
    digest = hashlib.sha256()
    for name in LAYERS[: LAYERS.index(layer) + 1]:
        digest.update(_digest_modules(source, name, drawing))
    if branch:
        digest.update(_digest_modules(source, last, drawing))
    if drawing:
        style = source / "plotting.py"
        digest.update(digest_code(style.read_text(encoding="utf-8"), style))
    return digest.hexdigest()[:16]


def is_branch(path: str) -> bool:
    """Whether a path below the package is a branch, or within one."""
    return any(path == branch or path.startswith(branch + "/") for branch in BRANCHES)


def is_showing(path: Path) -> bool:
    """Whether a module shows results and makes none."""
    return path.name in SHOWING or path.parent.name == FOLDER_OF_FIGURES


@cache
def _digest_modules(source: Path, part: str, drawing: bool) -> bytes:
    """Digest of the modules below a layer, without its branches, or of those of a branch."""
    digest = hashlib.sha256()
    found = sorted((source / part).rglob("*.py")) if (source / part).is_dir() else [source / part]
    for path in found:
        name = path.relative_to(source).as_posix()
        if (is_showing(path) and not drawing) or (part in LAYERS and is_branch(name)):
            continue
        digest.update(name.encode())
        digest.update(_digest_file(path))
    return digest.digest()


@cache
def _digest_file(path: Path) -> bytes:
    return digest_code(path.read_text(encoding="utf-8"), path)


def digest_code(source: str, path: str | Path = "<text>") -> bytes:
    """Digest of the statements of a module; `path` is for the message of a SyntaxError."""
    tree = ast.parse(source, str(path))
    for node in _blocks(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [s for s in node.body if not _is_docstring(s)] or [ast.Pass()]
    return hashlib.sha256(ast.dump(tree).encode()).digest()


def _blocks(tree: ast.Module) -> Iterator[ast.AST]:
    """A module and all its statements, without their expressions, which are many and hold no docstring."""
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
