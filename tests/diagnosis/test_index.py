"""The page over all datasets: what stands in its table, what can be set side by side, and that its links exist."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from myowave.diagnosis.report.contents import COMPARISON_NAMES, TABLE_NAMES
from myowave.diagnosis.report.index import Entry, read_entries, read_entry, write_index
from myowave.diagnosis.report.numbers import interval


@pytest.fixture(scope="module")
def entry(facts):
    def make(name: str, kind: str = "effect", **changes) -> Entry:
        found = {} if kind == "effect" else {"effects": [], "model": "base"}
        return Entry(facts(dataset=name, verdict=kind, **found | changes), {"kind": "measured", "test": ["trial3"]})

    return make


@pytest.fixture(scope="module")
def template(pytestconfig) -> Path:
    return pytestconfig.rootpath / "workflow/report/index.html.j2"


@pytest.fixture(scope="module")
def page(template, entry) -> str:
    entries = [entry("anna"), entry("ben", "adequate"), entry("cleo", "partial", horizon_s=0.5)]
    return write_index(entries, [("summary.csv", "summary.csv")], template)


def rows_of(page: str, table: str) -> list[list[str]]:
    """Texts of the cells of a table, row by row."""
    body = re.search(rf'<table[^>]+id="{table}">.*?</table>', page, re.DOTALL)[0].split("<tbody>")[1]
    cells = [re.findall(r"<td.*?</td>", row, re.DOTALL) for row in body.split("</tr>")[:-1]]
    return [[re.sub(r"<[^>]+>", " ", cell).strip() for cell in row] for row in cells]


def test_a_row_has_verdict_errors_and_parameters_of_the_model_that_was_found(page):
    anna, ben, cleo = rows_of(page, "datasets")
    assert anna[1:6] == ["anna", "missing: damping of the joint ( joint_damping )", "6.4 deg", "1.7 deg", "0.5 deg"]
    assert "f0 = 300.0 N (296.1 to 303.9)" in anna[6] and "joint_damping.c = 1.50 N m s/rad (1.30 to 1.70)" in anna[6]
    assert ben[2:5] == ["adequate", "6.4 deg", ""] and "f0 = 200.0 N" in ben[6]
    assert "more" in cleo[2] and cleo[3] == "6.4 deg over all of the 0.5 s after a measured state"


def test_facts_of_all_datasets_stand_beside_one_another(page):
    facts = {row[0]: row[1:] for row in rows_of(page, "beside")}
    plain = {re.sub(r"\s+", " ", name): values for name, values in facts.items()}
    assert plain["held-out RMSE , with what was found"] == ["1.7 deg", "", ""]
    assert plain["R2 of the torque, posture and speed"] == ["0.30"] * 3
    assert plain["RMSE 0.5 s after a measured state"] == ["1.2 deg", "3 deg", "3 deg"]
    assert plain["joint_damping.c ( 95 % interval )"] == ["1.50 N m s/rad (1.30 to 1.70)", "", ""]


def test_constants_that_nobody_asked_for_are_folded_away(template, entry):
    about = {"value": 1.0, "se": 0.1, "unit": "m", "low": 0.0, "high": 2.0, "error_pct": None}
    names = ("f0", "slack", "mass", "joint_damping.c")
    parameters = {name: {**about, "assumed": name in ("slack", "mass")} for name in names}
    anna = entry("anna", parameters={"base": parameters, "base+joint_damping": parameters})
    page = write_index([anna], [], template)
    shown, folded = rows_of(page, "datasets")[0][6].split("2 constants that were free as well")
    assert "f0 =" in shown and "joint_damping.c =" in shown and "slack =" in folded and "mass =" in folded


def test_links_lead_to_what_a_diagnosis_writes(page):
    files = {"verdict.html", "verdict.json", "watch.csv"} | {
        f"{name}.csv" for name in (*TABLE_NAMES, *COMPARISON_NAMES)
    }
    links = set(re.findall(r'href="diagnosis/anna/([^"]+)"', page))
    assert links == files
    assert 'href="summary.csv"' in page and "make ui" in page


def test_the_index_needs_no_network_and_escapes_what_comes_from_data(template, entry):
    page = write_index([entry("<script>alert(1)</script>")], [], template)
    assert "<script>alert" not in page and "default-src 'none'" in page
    assert not re.search(r"src=|@import|url\(", page.replace("default-src", ""))


def test_without_datasets_there_is_still_a_page(template):
    assert rows_of(write_index([], [], template), "datasets") == []


@pytest.mark.parametrize(
    ("value", "se", "unit", "text"),
    [
        (300.0, 2.0, "N", "300.0 N (296.1 to 303.9)"),
        (0.98, 0.0102, "-", "0.980 (0.960 to 1.000)"),
        (0.5, np.nan, "m", "0.5 m"),
        (0.5, 0.0, "m", "0.5 m"),
        (-0.001, 0.1, "-", "0.00 (-0.20 to 0.20)"),
        (1e-26, 1e-24, "-", "1e-26"),
    ],
)
def test_an_interval_has_the_digits_that_it_leaves(value, se, unit, text):
    assert interval(value, se, unit) == text


@pytest.mark.parametrize(
    ("value", "se", "text"),
    [
        (0.02, 0.31, "0.02 (0.02 to 0.63)"),
        (1.1, 0.05, "1.100 (1.002 to 1.150)"),
        (1.1, 3.6, "1.1 (not known: anywhere from 0.02 to 1.15)"),
    ],
)
def test_an_interval_holds_no_value_that_the_settings_rule_out(value, se, text):
    assert interval(value, se, "-", (0.02, 1.15)) == text


def test_noise_of_the_emg_stands_beside_effects_in_words(template, entry):
    entries = [
        entry("anna", effects=["joint_damping", "emg_noise"], emg_noise=0.02),
        entry("ben", effects=["emg_noise"], model="base", emg_noise=0.02),
    ]
    page = write_index(entries, [], template)
    assert page.count("noise of the recorded EMG (<code>emg_noise</code>)") >= 2
    assert "damping of the joint (<code>joint_damping</code>); noise of the recorded EMG" in page


def test_a_diagnosis_of_another_run_is_read_from_its_folder_and_one_of_another_version_is_refused(
    tmp_path, template, entry
):
    written = entry("anna")
    (tmp_path / "verdict.json").write_text(json.dumps(written.verdict))
    read = write_index([read_entry(tmp_path, {})], [], template)
    assert rows_of(read, "datasets")[0][1:6] == rows_of(write_index([written], [], template), "datasets")[0][1:6]
    assert "<pre>" not in read, "nobody knows the settings of that run"
    old = {key: value for key, value in written.verdict.items() if key != "rmse_deg"}
    (tmp_path / "verdict.json").write_text(json.dumps(old))
    with pytest.raises(ValueError, match=f"{tmp_path}.*another version.*remove it"):
        read_entry(tmp_path, {})
    said: list[str] = []
    assert list(read_entries({tmp_path: {}}, said.append)) == [] and "Left out of the index" in said[0]
