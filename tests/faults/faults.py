"""The rows of faults.yaml: where each fault has its place in the code, and the code with the fault in it.

A row names `module:qualified.name` of a function, class or constant and what is changed there, compared as syntax
trees: layout, comments and docstrings do not count, and a move to another module is followed. Outside of the package,
in studies and in the workflow's rules, the module is the file's path: `workflow/rules/data.smk:function`.
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
FAULTS = Path(__file__).with_name("faults.yaml")
MEND = (
    "`python tests/faults/replay.py --update` follows code that has moved; else mend or delete the row in faults.yaml"
)


class LostError(Exception):
    """A fault has no place in the code, or more than one."""


@dataclass(frozen=True)
class Fault:
    """A row of faults.yaml.

    Args:
        place: `module:qualified.name`.
        change, to: an expression or statements of it, which it has once, and what they become.
        killed_by: names of the tests that must fail.
    """

    place: str
    change: str
    to: str
    killed_by: tuple[str, ...]

    @property
    def module(self) -> str:
        return self.place.partition(":")[0]

    @property
    def name(self) -> str:
        return self.place.partition(":")[2]

    def __str__(self) -> str:
        return f"{self.place}: {self.change!r} -> {self.to!r}"


def read_faults() -> list[Fault]:
    """All rows, in the order of the file."""
    rows = yaml.safe_load(FAULTS.read_text(encoding="utf-8"))
    return [Fault(row["in"], row["change"], row["to"], tuple(row["killed_by"].split())) for row in rows]


def path_of(module: str) -> Path:
    """The file of a module, relative to the project."""
    return Path(module) if "/" in module else Path("src", *module.split(".")).with_suffix(".py")


def module_of(path: Path) -> str:
    """The other way round."""
    return ".".join(path.with_suffix("").parts[1:]) if path.parts[0] == "src" else str(path)


def with_fault(fault: Fault, root: Path) -> str:
    """The text of the fault's file in a copy of the project, with the fault in it.

    Raises:
        LostError: it has no place, or several.
    """
    path = root / path_of(fault.module)
    if not path.is_file():
        raise LostError(f"there is no {path_of(fault.module)}")
    blocks = _blocks(path)
    owners = [(i, node) for i, (_, tree) in enumerate(blocks) for node in _named(tree, fault.name)]
    if len(owners) != 1:
        raise LostError(f"{fault.module} has {len(owners)} of {fault.name!r}")
    number, owner = owners[0]
    found = _occurrences(owner, fault.change)
    if len(found) != 1:
        raise LostError(f"{fault.place} has {fault.change!r} {len(found)} times")
    tree = _changed(blocks[number][1], found[0], _parsed(fault.to))
    texts = [text for text, _ in blocks]
    texts[number] = ast.unparse(ast.fix_missing_locations(tree)) + "\n"
    return "".join(texts)


def moved(fault: Fault) -> Fault | None:
    """The same fault where the code now has it: in the one other module with that name, or under another name
    where the whole code has what it changes once; None where neither is so."""
    named, changed = [], []
    for path in _sources():
        for _, tree in _blocks(ROOT / path):
            for name, node in _definitions(tree):
                if _occurrences(node, fault.change):
                    place = replace(fault, place=f"{module_of(path)}:{name}")
                    changed.append(place)
                    named += [place] if name == fault.name else []
    # The innermost of nested definitions comes last: a method after its class.
    inner = [one for one in changed if not any(other.place.startswith(f"{one.place}.") for other in changed)]
    found = named if len(named) == 1 else inner
    return found[0] if len(found) == 1 and _fits(found[0]) else None


def update() -> list[Fault]:
    """Rewrite the rows of faults whose code has moved; returns those that stay lost."""
    text = FAULTS.read_text(encoding="utf-8")
    lost: list[Fault] = []
    begins = [line.start(1) for line in re.finditer(r"^- in: (.*)$", text, re.MULTILINE)]
    faults = read_faults()
    assert len(begins) == len(faults)
    for begin, fault in reversed(list(zip(begins, faults, strict=True))):
        if _fits(fault):
            continue
        new = moved(fault)
        if new is None:
            lost.insert(0, fault)
        else:
            text = text[:begin] + new.place + text[begin + len(fault.place) :]
    FAULTS.write_text(text, encoding="utf-8")
    return lost


def files_of(test: str, root: Path) -> list[str]:
    """The files, relative to the project, that hold a test of this name."""
    return sorted({str(path) for path in _tests(root).get(test.partition("[")[0], [])})


@cache
def _tests(root: Path) -> dict[str, list[Path]]:
    """Test files by the names of their tests."""
    found: dict[str, list[Path]] = {}
    for path in sorted((root / "tests").rglob("test_*.py")) + sorted((root / "studies").rglob("test_*.py")):
        for name in re.findall(r"^def (test_\w+)\(", path.read_text(encoding="utf-8"), re.MULTILINE):
            found.setdefault(name, []).append(path.relative_to(root))
    return found


def _fits(fault: Fault) -> bool:
    try:
        with_fault(fault, ROOT)
    except LostError:
        return False
    return True


def _sources() -> Iterator[Path]:
    for pattern in ("src/**/*.py", "workflow/**/*.smk", "studies/**/*.py", "studies/**/Snakefile"):
        for path in sorted(ROOT.glob(pattern)):
            if "tests" not in path.parts:
                yield path.relative_to(ROOT)


def _blocks(path: Path) -> list[tuple[str, ast.Module]]:
    """The text of a file in blocks, each with its syntax tree: a module is one; of rules every function is one, and
    what is not Python has an empty tree."""
    return _blocks_of(path, path.stat().st_mtime_ns)


@cache
def _blocks_of(path: Path, _date: int) -> list[tuple[str, ast.Module]]:
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        return [(text, ast.parse(text))]
    blocks = []
    for block in re.split(r"^(?=\S)", text, flags=re.MULTILINE):
        try:
            blocks.append((block, ast.parse(block)))
        except SyntaxError:
            blocks.append((block, ast.Module([], [])))
    return blocks


def _definitions(tree: ast.AST, above: str = "") -> Iterator[tuple[str, ast.stmt]]:
    """Qualified names of a tree with their nodes: functions, classes, and names with a value."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield f"{above}{node.name}", node
            yield from _definitions(node, f"{above}{node.name}.")
        elif isinstance(node, ast.Assign | ast.AnnAssign) and not isinstance(tree, ast.FunctionDef):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            for name in (n for target in targets for n in ast.walk(target) if isinstance(n, ast.Name)):
                yield f"{above}{name.id}", node


def _named(tree: ast.AST, name: str) -> list[ast.stmt]:
    return [node for qualified, node in _definitions(tree) if qualified == name]


def _parsed(text: str) -> list[ast.AST]:
    """One expression, or statements."""
    body = ast.parse(text).body
    return [body[0].value] if len(body) == 1 and isinstance(body[0], ast.Expr) else list(body)


def _occurrences(owner: ast.AST, change: str) -> list[list[ast.AST]]:
    """Where an expression or a run of statements stands in a tree: the nodes of each place."""
    wanted = [ast.dump(node) for node in _parsed(change)]
    if len(wanted) == 1 and not isinstance(_parsed(change)[0], ast.stmt):
        return [[node] for node in ast.walk(owner) if isinstance(node, ast.expr) and ast.dump(node) == wanted[0]]
    found = []
    for node in ast.walk(owner):
        for _, body in ast.iter_fields(node):
            if isinstance(body, list) and body and isinstance(body[0], ast.stmt):
                starts = range(len(body) - len(wanted) + 1)
                runs = [body[i : i + len(wanted)] for i in starts]
                found += [run for run in runs if [ast.dump(one) for one in run] == wanted]
    return found


def _changed(tree: ast.Module, old: list[ast.AST], new: list[ast.AST]) -> ast.Module:
    """A tree with other nodes in the place of some."""

    class Change(ast.NodeTransformer):
        def visit(self, node: ast.AST) -> ast.AST | list[ast.AST] | None:
            if node is old[0]:
                return new[0] if isinstance(node, ast.expr) else new
            return None if any(node is other for other in old[1:]) else self.generic_visit(node)

    copy = ast.parse(ast.unparse(tree))  # the tree is kept for the next fault
    twins = dict(zip(map(id, ast.walk(tree)), ast.walk(copy), strict=True))
    old = [twins[id(node)] for node in old]
    Change().visit(copy)
    return copy
