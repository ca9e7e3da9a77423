"""Digest of what the code does, so that a workflow knows when a result is out of date.

The layers stand on one another, so a layer's digest covers those before it. Comments, layout and docstrings do not
count: they change no result. Modules called `figures.py` and `page.py` show results and make none, so they count only
for drawing.
"""

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

SHOWING = ("figures.py", "page.py")
LAYERS = ("physics", "data", "learning", "diagnosis")
_SOURCE = Path(__file__).parent


def digest_layers(last: str, *, drawing: bool = False, source: Path = _SOURCE) -> str:
    """Digest of a layer and all layers before it.

    Args:
        last: one of `LAYERS`.
        drawing: whether the modules that draw count.
        source: folder of the package.
    """
    digest = hashlib.sha256()
    for layer in LAYERS[: LAYERS.index(last) + 1]:
        digest.update(_digest_layer(source / layer, drawing))
    if drawing:
        style = source / "plotting.py"
        digest.update(digest_code(style.read_text(encoding="utf-8"), style))
    return digest.hexdigest()[:16]


@cache
def _digest_layer(folder: Path, drawing: bool) -> bytes:
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        if path.name in SHOWING and not drawing:
            continue
        digest.update(str(path.relative_to(folder)).encode())
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
