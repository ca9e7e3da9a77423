"""No page gives two values for one thing: a reader collects all that is said, and compares."""

import json
import re
from collections import defaultdict
from pathlib import Path

import pandas as pd
import pytest

from myowave.diagnosis.report.cells import accuracy_cells, parameter_cells
from myowave.diagnosis.report.ladder import join_parameters, shown_network
from myowave.diagnosis.report.tell import tell
from myowave.diagnosis.report.templates import described

ROOT = Path(__file__).parents[2]
NUMBER = r"((?:at most |under |over )?-?\d[\d.]*(?: deg| N m)?)"
SAID = {  # thing: how a page may say it
    "noise of the angle": rf"noise of the (?:measured )?angle(?:,| is| of)? {NUMBER}",
    "noise of the EMG": rf"noise of (?:the recorded )?EMG.{{0,90}}? moves the (?:simulated )?arm by {NUMBER}",
    "error of the network": rf"network.{{0,60}} misses by {NUMBER}",
    "R² of the network": rf"misses by {NUMBER} \(R² {NUMBER}\)",
}


def said(verdict: dict, ladder: pd.DataFrame, parameters: pd.DataFrame) -> dict[str, set[str]]:
    """All values that a page gives, by what they are of."""
    found: dict[str, set[str]] = defaultdict(set)
    network = shown_network(ladder, verdict["model"])
    shown = "" if network is None else described(f"{network['source']}, {network['model']}", verdict["titles"])
    text = " ".join(part for part in tell(verdict, ladder).values() if isinstance(part, str))
    for thing, pattern in SAID.items():
        for match in re.finditer(pattern, text, re.IGNORECASE):
            found[thing].add(match.groups()[-1])
    for model, torque in re.findall(rf"(muscle model[^.]*) lacks (?:a torque of|no torque [^,]*,) {NUMBER}", text):
        found[f"missing torque of {model}"].add(torque)
    cells = accuracy_cells(verdict, ladder)
    for row in cells.to_dict("records"):
        thing = f"{row['what']} from {row['starts from']} over {row['error over']}"
        for part in ("training error", "held-out error"):
            found[f"{thing}, {part}"].add(row[part])
        if row["what"] == shown:
            found["error of the network"].add(row["held-out error"])
            found["R² of the network"].add(row["held-out R²"])
    own = described(verdict["model"], verdict["titles"])
    if headline := re.search(rf"on held-out trials is(?: then)? {NUMBER}", text):
        found[f"{own} from fitted angle and speed over whole trials, held-out error"].add(headline[1])
    mine = parameters[(parameters["model"] == verdict["model"]) & (parameters["source"] == "physics")]
    for row in parameter_cells(mine).to_dict("records"):
        found[re.search(r"\((\S+)\)$", row["parameter"])[1]].add(row["value ± SE"])
    for effect in verdict["effects"]:
        for name, value in re.findall(r"(\w+) = (\S+ ± [\d.]*\d|[\d.]*\d)", text):
            if f"{effect}.{name}" in found:
                found[f"{effect}.{name}"].add(value)
    return found


def twice(found: dict[str, set[str]]) -> dict[str, set[str]]:
    return {thing: values for thing, values in found.items() if len(values) > 1}


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"verdict": "adequate", "effects": [], "model": "base"},
        {"verdict": "unknown", "effects": [], "model": "base", "missing_deg": 2.2, "formula": "+1.2 q"},
        {"verdict": "partial", "missing_deg": 0.3},
        {"verdict": "effect", "effects": ["joint_damping", "emg_noise"], "emg_noise": 0.02, "emg_motion_deg": 1.2},
        {"follows": False, "horizon_s": 0.5, "effects": [], "model": "base"},
        {"noise_is_bound": True},
    ],
)
def test_a_made_up_verdict_gives_one_value_for_each_thing(changes, facts):
    verdict = facts(**changes)
    errors = verdict["rmse_deg"]
    rows = [("physics", m, e["train"], e["heldout"], 0.98, 0, "") for m, e in errors.items()]
    rows.append(("network, rollout, 1-scale", verdict["model"], float("nan"), 1.43, 0.987, 5, ""))
    columns = ["source", "model", "train_rmse_deg", "heldout_rmse_deg", "heldout_r2", "seeds", "failed_seeds"]
    found = said(verdict, pd.DataFrame(rows, columns=columns), join_parameters(verdict, []))
    assert {"noise of the angle", "error of the network", "R² of the network"} < set(found)
    assert twice(found) == {}


def test_the_reader_notices_a_second_value(facts):
    verdict = facts()
    ladder = pd.DataFrame(
        [("physics", m, e["train"], e["heldout"] + 0.1, 0.98, 0, "") for m, e in verdict["rmse_deg"].items()],
        columns=["source", "model", "train_rmse_deg", "heldout_rmse_deg", "heldout_r2", "seeds", "failed_seeds"],
    )
    assert twice(said(verdict, ladder, join_parameters(verdict, [])))


def test_no_page_in_results_gives_two_values_for_one_thing():
    for path in sorted(ROOT.glob("results/diagnosis/*/verdict.html")):  # a run that was stopped has some without
        verdict = json.loads(path.with_name("verdict.json").read_text(encoding="utf-8"))
        if not {"torque_noise_Nm", "torque"} < set(verdict):
            continue  # of another version, which its own index leaves out
        found = said(verdict, pd.read_csv(path.with_name("watch.csv")), join_parameters(verdict, []))
        assert twice(found) == {}, path
