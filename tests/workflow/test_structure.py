"""How the code is put together: layers import downwards, outside libraries have one door, Snakemake stays outside."""

import ast
import re
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from project_copy import ROOT

SOURCE = ROOT / "src/myowave"
STUDIES = ROOT / "studies"
# What each layer may import besides itself.
LAYERS = {
    "physics": (),
    "data": ("physics",),
    "identification": ("physics", "data"),
    "learning": ("physics", "data", "identification"),
    "diagnosis": ("physics", "data", "identification"),
}
# What the sub-packages of a layer may import of one another; all may use the modules directly in the layer, "".
PARTS = {
    "learning": {
        "": ("methods",),
        "methods": (),
        "streaming": (),
        "sweep": (),
    },
    "diagnosis": {
        "": (),
        "likelihood": (),
        "comparison": ("likelihood",),
        "search": ("likelihood",),
        "changed": ("likelihood",),
        "report": ("likelihood", "comparison", "search", "changed"),
    },
}
DOORS = {
    "mlflow": "tracking/store.py",
    "opensim": "starting/geometry.py",
    "optuna": "learning/sweep",
    "pywt": "data/wavelets.py",
    "pyarrow": "data/store.py",
    "sklearn": "learning/baselines.py",
}
# Beside the layers: they may be used by any, and use none but those named here.
BESIDE = {
    "settings": ("physics",),  # its list of constants, which loads nothing
    "models.py": ("physics",),
    "starting": ("physics", "data"),
    "workflow": (),
    "plotting.py": (),
    "scores.py": (),
    "tracking": ("data", "learning", "diagnosis"),
    "cli.py": ("physics", "data", "learning", "diagnosis"),
    "notebook.py": ("physics", "data", "diagnosis"),
    "watching.py": ("physics", "data", "identification", "diagnosis"),
    "__init__.py": ("data",),  # loaded when it is asked for
}
MODULES = sorted(SOURCE.rglob("*.py"))


def imported(path: Path) -> set[str]:
    """Dotted names of all that a module imports, inside functions too."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports of the package are written in full"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def layers_used(path: Path) -> set[str]:
    return {layer for layer in LAYERS for name in imported(path) if f"{name}.".startswith(f"myowave.{layer}.")}


def test_the_layers_are_those_of_the_architecture():
    """In its line such as a <- b <- {c | d}, each imports those before it, and those in braces not each other."""
    (line,) = re.findall(r"physics (?:<-|←) [^*`\n]+", (ROOT / "ARCHITECTURE.md").read_text())[:1]
    drawn: dict[str, tuple[str, ...]] = {}
    for step in re.split("<-|←", line):
        drawn |= dict.fromkeys(re.findall(r"\w+", step), tuple(drawn))
    assert drawn == LAYERS


@pytest.mark.parametrize("layer", LAYERS)
def test_a_layer_imports_only_those_before_it(layer):
    before = {layer, *LAYERS[layer]}
    for path in (SOURCE / layer).rglob("*.py"):
        assert layers_used(path) <= before, f"{path} imports upwards"


def test_physics_imports_nothing_else_of_the_package():
    for path in (SOURCE / "physics").rglob("*.py"):
        own = [name for name in imported(path) if name.split(".")[0] == "myowave"]
        assert all(name.startswith("myowave.physics.") for name in own), path


@pytest.mark.parametrize("layer", PARTS)
def test_parts_of_a_layer_import_one_another_in_one_direction(layer):
    for path in (SOURCE / layer).rglob("*.py"):
        part, *inside = path.relative_to(SOURCE / layer).parts
        part = part if inside else ""
        assert part in PARTS[layer], f"{layer}/{part}: name it here, with the parts it may use"
        used = {
            p for p in PARTS[layer] for name in imported(path) if p and f"{name}.".startswith(f"myowave.{layer}.{p}.")
        }
        assert used <= {part, *PARTS[layer][part]}, path


def test_modules_beside_the_layers_use_no_more_of_them_than_they_need():
    for path in MODULES:
        part = path.relative_to(SOURCE).parts[0]
        if part not in LAYERS:
            assert part in BESIDE, f"{part}: name it here, with the layers it may use"
            assert layers_used(path) <= set(BESIDE[part]), path


def test_what_computes_does_not_draw():
    # Else a changed picture would make what was computed out of date, by the digest of the code.
    for path in MODULES:
        if path.parent.name != "figures" and path.name not in ("figures.py", "plotting.py") and path.parent != SOURCE:
            drawing = [n for n in imported(path) if "figures" in n or n.startswith(("matplotlib", "myowave.plotting"))]
            assert not drawing, f"{path} imports {drawing}"


@pytest.mark.parametrize("library", DOORS)
def test_an_outside_library_has_one_door(library):
    users = {
        str(path.relative_to(SOURCE)) for path in MODULES for name in imported(path) if name.split(".")[0] == library
    }
    assert all(user.startswith(DOORS[library]) for user in users), users


def test_no_modules_import_each_other_in_a_circle():
    """Not within functions either: who reads one of them would have to read all."""
    modules = {".".join(path.relative_to(SOURCE.parent).with_suffix("").parts): path for path in MODULES}
    modules = {name.removesuffix(".__init__"): path for name, path in modules.items()}
    uses = {
        module: {name if name in modules else name.rpartition(".")[0] for name in imported(path)} & modules.keys()
        for module, path in modules.items()
    }
    TopologicalSorter({module: used - {module} for module, used in uses.items()}).prepare()


def test_the_package_does_not_know_snakemake():
    for path in MODULES:
        assert not [name for name in imported(path) if name.split(".")[0].startswith("snakemake")], path


def test_studies_use_the_package_and_are_used_by_nothing():
    for path in [*MODULES, *(ROOT / "workflow/scripts").glob("*.py")]:
        assert not [name for name in imported(path) if name.split(".")[0] == "studies"], path
    for study in (path.parent for path in STUDIES.glob("*/tests")):
        for path in study.rglob("*.py"):
            used = {".".join(name.split(".")[:2]) for name in imported(path) if name.split(".")[0] == "studies"}
            assert used <= {f"studies.{study.name}", "studies.shared"}, f"{path} imports another study"


def test_scripts_belong_to_rules_and_hold_no_logic():
    rules = "".join(
        path.read_text() for path in [*(ROOT / "workflow/rules").glob("*.smk"), *STUDIES.glob("*/Snakefile")]
    )
    for path in [*(ROOT / "workflow/scripts").glob("*.py"), *STUDIES.glob("*/scripts/*.py")]:
        assert f"scripts/{path.name}" in rules, f"{path.name}: no rule calls it"
        for node in ast.walk(ast.parse(path.read_text())):
            assert not isinstance(node, ast.FunctionDef | ast.ClassDef | ast.If | ast.While | ast.Try), path


def test_captions_are_there_and_each_is_of_one_output():
    seen = []
    for path in (ROOT / "workflow/rules").glob("*.smk"):
        for part in re.split('caption=f?"', path.read_text())[1:]:
            seen.append(name := re.sub(r"{\w+}", "*", part.split('"')[0]))  # with a variable for all that match
            captions = list(path.parent.glob(name))
            assert captions, f"{path.name}: no caption {name}"
            for caption in captions:
                assert len(caption.read_text().split()) > 5, f"{caption} says too little"
    assert len(seen) == len(set(seen)), "two outputs have one caption"
