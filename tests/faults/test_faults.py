"""The list of deliberate faults stays in step with the code; `make mutants` puts them in."""

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
specification = importlib.util.spec_from_file_location("replay", Path(__file__).with_name("replay.py"))
replay = importlib.util.module_from_spec(specification)
specification.loader.exec_module(replay)


def test_no_fault_is_lost_because_its_row_has_a_key_twice():
    """YAML keeps the last of them and says nothing."""
    for row in replay.FAULTS.read_text(encoding="utf-8").split("\n- file: ")[1:]:
        assert [row.count(f"\n  {key}:") for key in ("old", "new", "killed_by")] == [1, 1, 1], row


@pytest.mark.parametrize("fault", replay.read_faults(), ids=lambda fault: f"{fault['file']}: {fault['new'][:40]}")
def test_a_fault_has_its_place_in_the_code_and_a_test_that_knows_it(fault):
    assert (ROOT / fault["file"]).read_text().count(fault["old"]) == 1 and fault["new"] != fault["old"]
    for test in fault["killed_by"]:
        file, _, name = test.partition("::")
        assert f"def {name.partition('[')[0]}(" in (ROOT / file).read_text(), test
