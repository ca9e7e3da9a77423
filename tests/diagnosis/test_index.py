"""The page over all datasets: what stands in its table, and that its links exist."""

import json
import re
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from myowave.diagnosis.report.index import write_index
from myowave.plotting import canvas, save

COLUMNS = ["source", "model", "train_rmse_deg", "heldout_rmse_deg", "heldout_r2", "seeds", "failed_seeds"]
LADDER = pd.DataFrame(
    [
        ("physics", "base", 3.3, 6.4, 0.9, np.nan, ""),
        ("network, rollout, 1-scale", "base", np.nan, 2.5, 0.97, 5, ""),
        ("network, rollout, 1-scale", "base+joint_damping", np.nan, 1.4, 0.99, 5, ""),
    ],
    columns=COLUMNS,
)


@pytest.fixture
def entry(facts, tmp_path):
    """The folder of a diagnosis, as the rules write it."""
    figure, _ = canvas(width=1.0, height=1.0)

    def make(name: str, kind: str = "effect", **changes) -> Path:
        found = {} if kind == "effect" else {"effects": [], "model": "base"}
        folder = tmp_path / "diagnosis" / str(abs(hash(name)))
        folder.mkdir(parents=True)
        (folder / "verdict.json").write_text(json.dumps(facts(dataset=name, verdict=kind, **found | changes)))
        LADDER.to_csv(folder / "watch.csv", index=False)
        save(figure, tmp_path / f"figures/{folder.name}/diagnosis/glance.png")
        return folder

    return make


SETTINGS = {"about": "swings a <hammer>", "kind": "measured", "test": ["trial3"]}


@pytest.fixture
def page(entry) -> str:
    folders = [entry("anna"), entry("ben", "adequate"), entry("cleo", "partial", horizon_s=0.5)]
    return write_index(dict.fromkeys(folders, SETTINGS), [("summary.csv", "summary.csv")])


def rows_of(page: str, table: str) -> list[list[str]]:
    """Texts of the cells of a table, row by row."""
    body = re.search(rf'<table[^>]+id="{table}">.*?</table>', page, re.DOTALL)[0].split("<tbody>")[1]
    cells = [re.findall(r"<td.*?</td>", row, re.DOTALL) for row in body.split("</tr>")[:-1]]
    return [[re.sub(r"<[^>]+>", " ", cell).strip() for cell in row] for row in cells]


def test_a_row_has_picture_verdict_errors_and_what_to_do(page):
    anna, ben, cleo = rows_of(page, "datasets")
    assert anna[0].split() == ["anna", "swings", "a", "&lt;hammer&gt;"], "what the settings say, of no name by itself"
    assert anna[2] == "missing: damping of the joint"
    assert anna[3] == "6.4 deg, 1.7 deg with what was found"
    assert anna[4].split() == ["1.4", "deg", "R²", "0.99"], "the network with the model that was found"
    assert anna[5].startswith("use the parameters"), "such a network is trained"
    assert ben[2:4] == ["adequate", "6.4 deg"] and ben[4].split()[0] == "2.5"
    assert "more" in cleo[2] and cleo[3].startswith("6.4 deg over 0.5 s from each measured state")
    assert page.count("data:image/png") == 3


def test_the_page_says_what_it_is_and_when_it_was_made(page):
    assert "<h1>How an elbow moves with the EMG of its muscles, and what a muscle model" in page
    assert re.search(rf"Made \d{{4}}-\d\d-\d\d, myowave {re.escape(version('myowave'))}", page)


def test_links_lead_to_the_pages_and_to_what_belongs_to_all(page):
    assert set(re.findall(r'href="diagnosis/anna/([^"]+)"', page)) == {"verdict.html"}
    assert 'href="summary.csv"' in page and "make ui" in page


def test_the_index_needs_no_network_and_escapes_what_comes_from_data(entry):
    page = write_index({entry("<script>alert(1)</script>"): SETTINGS}, [])
    assert "<script>alert" not in page and "default-src 'none'" in page
    assert not re.search(r'src="(?!data:)|@import|url\(', page)


def test_without_datasets_there_is_still_a_page():
    assert rows_of(write_index({}, []), "datasets") == []


def test_noise_of_the_emg_stands_beside_effects_in_words(entry):
    entries = [
        entry("anna", effects=["joint_damping", "emg_noise"], emg_noise=0.02),
        entry("ben", effects=["emg_noise"], model="base", emg_noise=0.02),
    ]
    page = write_index(dict.fromkeys(entries, SETTINGS), [])
    anna, ben = (row[2] for row in rows_of(page, "datasets"))
    assert anna == "missing: damping of the joint and noise of the recorded EMG"
    assert ben == "missing: noise of the recorded EMG"


def test_a_diagnosis_of_another_run_has_no_settings_and_one_of_another_version_is_said_and_left_out(entry):
    said: list[str] = []
    other, old, cut = entry("anna"), entry("ben"), entry("cleo")
    (old / "verdict.json").write_text(json.dumps({"verdict": "effect", "dataset": "ben"}))
    (cut / "watch.csv").unlink()
    page = write_index(dict.fromkeys((other, old, cut), {}), [], said.append)
    assert [row[0] for row in rows_of(page, "datasets")] == ["anna"]
    assert "<pre>" not in page, "nobody knows the settings of that run"
    assert len(said) == 2 and all("another version" in line and "remove it" in line for line in said)
    assert str(old) in said[0] and str(cut) in said[1]
