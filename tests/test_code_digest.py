"""Which code a digest stands for."""

from pathlib import Path

import pytest

from myowave.code_digest import BRANCHES, digest_layers

FILES = (
    "plotting.py", "physics/joint.py", "physics/effects/damping.py", "data/store.py", "data/figures.py",
    "learning/training.py", "learning/streaming.py", "learning/sweep/study.py", "learning/sweep/objective.py",
    "learning/sweep/figures.py", "learning/paper/tables.py", "diagnosis/fit.py", "diagnosis/study.py",
    "diagnosis/subjects/table.py",
)  # fmt: skip
SWEEP = "learning/sweep"


def digest(folder: Path, last: str, drawing: bool, changed: str | None) -> str:
    """Digest of a made-up package in which one file was changed."""
    for name in FILES:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"VALUE = {2 if name == changed else 1}\n")
    return digest_layers(last, drawing=drawing, source=folder)


@pytest.mark.parametrize(
    ("last", "drawing", "counts"),
    [
        ("data", False, FILES[1:4]),
        ("data", True, FILES[:5]),
        ("learning", False, (*FILES[1:4], "learning/training.py")),
        ("diagnosis", False, (*FILES[1:4], "learning/training.py", "diagnosis/fit.py")),
        (SWEEP, False, (*FILES[1:4], "learning/training.py", f"{SWEEP}/study.py", f"{SWEEP}/objective.py")),
        (f"{SWEEP}/objective.py", False, (*FILES[1:4], "learning/training.py", f"{SWEEP}/objective.py")),
        ("diagnosis/study.py", False, (*FILES[1:4], "learning/training.py", "diagnosis/fit.py", "diagnosis/study.py")),
    ],
)
def test_a_digest_changes_with_its_layers_and_its_branch_alone(tmp_path, last, drawing, counts):
    unchanged = digest(tmp_path / "0", last, drawing, None)
    changing = {name for i, name in enumerate(FILES, 1) if digest(tmp_path / str(i), last, drawing, name) != unchanged}
    assert changing == set(counts)


def test_a_branch_that_is_not_there_is_refused():
    with pytest.raises(ValueError, match="learning/training"):
        digest_layers("learning/training.py")
    for branch in BRANCHES:  # those that are named are there
        digest_layers(branch)
