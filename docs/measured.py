"""Write every number of README and of docs/ that the main job measures: `make readme`, after `make run`.

It reads results/, docs/study_*.csv, docs/changed_cases.csv, docs/reality.csv and docs/held_out.csv, writes
docs/numbers.json and pictures, and fills the blocks between `<!-- numbers: NAME -->` and `<!-- end -->`. A test holds
the blocks to docs/numbers.json.
"""

import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from shutil import copyfile, which
from textwrap import dedent
from typing import Any

import numpy as np
import pandas as pd
import yaml

from myowave.data.json_files import read_json
from myowave.diagnosis.causes import CAUSE_TITLES, OUTSIDE
from myowave.diagnosis.report.templates import described
from myowave.physics.effects import SHIPPED
from myowave.scores import TITLES as RIVALS
from studies.changed.answers import table, trials_needed
from studies.changed.questions import PERSON as PEOPLE
from studies.held_out.page import by_question, differences, lowest
from studies.reality.score import GRADES
from studies.shared import markdown
from studies.verdicts.summary import answered_visible, true_names

ROOT = Path(__file__).parents[1]
NUMBERS = ROOT / "docs/numbers.json"
PERSON, SIMULATOR, HIDDEN = "human_curls", "bench_elbow", "hidden"
PICTURES = {  # of results/figures, as they are
    "person_torque.png": f"{PERSON}/diagnosis/torque.png",
    "person_horizons.png": f"{PERSON}/diagnosis/horizons.png",
    "person_network.png": f"{PERSON}/base/recorded/predictions.png",
    "ladder.png": f"{SIMULATOR}/diagnosis/ladder.png",
    "missing_torque.png": f"{SIMULATOR}/diagnosis/missing_torque.png",
    "ranking.png": f"{SIMULATOR}/diagnosis/ranking.png",
}
CONFIG = yaml.safe_load((ROOT / "config.yaml").read_text(encoding="utf-8"))
ABOUT = {name: block["about"] for name, block in CONFIG["data"]["datasets"].items()}
DATASETS = {name: ABOUT[name] for name in (PERSON, SIMULATOR, HIDDEN, "case1", "case3")} | {
    HIDDEN: "simulated; crosstalk and noise of the EMG hidden",  # the page of results must not tell
}
ANSWERS = {"adequate": "nothing", "unknown": "no answer"}
TITLES = {effect.name: effect.title for effect in SHIPPED} | CAUSE_TITLES
BASELINES = CONFIG["learning"]["baselines"]
BLOCK = re.compile(r"(<!-- numbers: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def collect(results: Path) -> dict[str, Any]:
    """What the main job measured, as README needs it."""
    verdicts = {path.parent.name: read_json(path) for path in results.glob("diagnosis/*/verdict.json")}
    torque = pd.read_csv(results / f"diagnosis/{PERSON}/torque.csv").query("held_out")
    ahead = pd.read_csv(results / f"diagnosis/{PERSON}/horizons.csv").query("held_out and horizon_s == 0.5")
    return {
        "verdicts": {
            name: {
                "kind": verdict["verdict"],
                "effects": verdict["effects"],
                "model": verdict["model"],
                "horizon_s": verdict["horizon_s"],
                "errors_deg": [verdict["rmse_deg"][model]["heldout"] for model in ("base", verdict["model"])],
            }
            for name, verdict in sorted(verdicts.items())
        },
        "estimates": _estimates(verdicts[HIDDEN]),
        "networks": list(_networks(pd.read_csv(results / "summary.csv"), pd.read_csv(results / "scales.csv"))),
        "person": {
            "torque_r2": _mean_r2(torque),
            "ahead_deg": dict(zip(ahead["predictor"], ahead["rmse_deg"], strict=True)),
        },
        "study": _study(
            *(pd.read_csv(ROOT / f"docs/study_{name}.csv", keep_default_na=False) for name in ("cases", "before"))
        ),
        "changed": _changed(pd.read_csv(ROOT / "docs/changed_cases.csv", keep_default_na=False, na_values=[""])),
        "reality": _reality(pd.read_csv(ROOT / "docs/reality.csv")),
        "held_out": _held_out(pd.read_csv(ROOT / "docs/held_out.csv")),
    }


def _mean_r2(torque: pd.DataFrame) -> dict[str, float]:
    return {str(name): float(r2) for name, r2 in torque.groupby("model", sort=False)["r2"].mean().items()}


def _estimates(verdict: dict[str, Any]) -> dict[str, float]:
    """How far the estimates of what was identified are off, and their standard errors, the worst of each [%]."""
    found = [p for p in verdict["parameters"][verdict["model"]].values() if p["error_pct"] is not None]
    found = [p for p in found if not p["assumed"]]
    return {
        "off_pct": max(abs(p["error_pct"]) for p in found),
        "se_pct": max(100 * p["se"] / abs(p["true"]) for p in found),
    }


def _networks(summary: pd.DataFrame, scales: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Medians over the seeds of every network, and what more scales did to it."""
    runs = ["dataset", "model", "recipe"]
    found = scales.set_index(runs)["finding"].to_dict()
    errors = [name for name in summary if name.endswith("_error_pct")]
    for key, rows in summary.groupby([*runs, "scales"]):
        wrong = rows[errors].abs().mean().max()
        yield {
            **dict(zip([*runs, "scales"], key, strict=True)),
            "r2": rows["test_r2"].fillna(-np.inf).median(),
            "deg": rows["test_rmse_deg"].fillna(np.inf).median(),
            "band": None if rows["band_coverage"].isna().all() else rows["band_coverage"].median(),
            "parameter_error_pct": None if np.isnan(wrong) else wrong,
            "more_scales": found.get(key[:3], ""),
            "baseline": key[2] in BASELINES,
        }


def _reality(cases: pd.DataFrame) -> dict[str, Any]:
    """How many answers there are of each grade, and what was found in measured motion whose error then fell most."""
    right = cases["grade"].isin(["named", "class"]) & (cases["kind"] == "measured")
    named = cases[right].dropna(subset=["error_after"])
    best = named.loc[(named["error_after"] / named["error_before"]).idxmin()]
    return {
        "grades": cases["grade"].value_counts().to_dict(),
        "best": {
            "system": best["system"],
            "effects": best["names"].split(", "),
            "like": OUTSIDE in str(best["class"]),
            "more": best["verdict"] == "partial",
            "errors_deg": [best["error_before"], best["error_after"]],
        },
    }


def _changed(cases: pd.DataFrame) -> dict[str, Any]:
    """Answers to what changed of a person and of simulated arms, as tables, and how many trials a load needs."""
    person, arms = (cases[part] for part in (cases["of"].eq(PEOPLE), cases["of"].ne(PEOPLE)))
    return {
        "person": table(person, "done"),
        "arms": table(arms, "done"),
        "arms_of": table(arms, "of"),
        "trials_needed": {str(count): orders for count, orders in sorted(trials_needed(person).items())},
    }


def _held_out(rows: pd.DataFrame) -> dict[str, Any]:
    """How far networks and baselines err by question, what choices change, and the worst of the network."""
    return {"by_question": by_question(rows), "differences": differences(rows), "lowest": lowest(rows)}


def _study(cases: pd.DataFrame, before: pd.DataFrame) -> dict[str, Any]:
    """What the answers of all draws are worth, and how many of the last one are wrong."""
    rows = pd.concat([before, cases])
    visible = answered_visible(rows)
    return {
        "arms": len(rows),
        "wrong": int(rows["grade"].eq("wrong").sum()),
        "last": [int(cases["grade"].eq("wrong").sum()), len(cases)],
        "visible": [int(visible.sum()), len(visible)],
        "names": list(true_names(rows)),
    }


def blocks(numbers: dict[str, Any]) -> dict[str, str]:
    """Markdown by the name of its block."""
    person, simulator, study = numbers["person"], numbers["verdicts"][SIMULATOR], numbers["study"]
    best, off = _network(numbers, PERSON), numbers["estimates"]
    r2, ahead = person["torque_r2"], person["ahead_deg"]
    before, after = simulator["errors_deg"]
    grades, best_found = numbers["reality"]["grades"], numbers["reality"]["best"]
    told = ", ".join(f"{grades[grade]} {word}" for grade, word in GRADES.items() if grade in grades)
    first, last = best_found["errors_deg"]
    texts = {
        "caption": f"""
            *Machines and a person that others recorded, and an arm that OpenSim moves: something known of each was
            withheld. Of {sum(grades.values())} answers {told}. The method changed while many of the
            answers were known.*""",
        "get": f"""
            - **The angle from EMG**, sample by sample, with a 90 % band: {best["deg"]:.0f} deg off on a person's unseen
              trials.
            - **The muscles' parameters** with standard errors: at most {off["off_pct"]:.0f} % off (standard errors
              up to {off["se_pct"]:.0f} %) in a simulated arm with noisy EMG.
            - **What the model misses**: for a measured {best_found["system"]} it names
              {_titles(best_found, " and ")}{', "or something like them"' * best_found["like"]}{
            ", and says that more is missing" * best_found["more"]
        }.
              With these the error on unseen motion falls from {_small(first, "")} to {_small(last, "deg")}.
            - **A plain no** where a muscle model does not follow, and what to record instead. On the person
              it explains {100 * r2["base"]:.0f} % of the torque, and is {ahead["base"]:.0f} deg off after half a
              second.""",
        "compare": f"""
            **Compare.** The published muscle model, fitted to four trials with every constant free that nobody
            measured, misses the fifth by {_small(before, "deg")}.""",
        "trust": f"""
            Of {study["arms"]} simulated arms {study["wrong"]} were judged wrong
            ({_percent(study["wrong"] / study["arms"])}; {study["last"][0] or "none"} of the last {study["last"][1]}),
            {study["visible"][0]} of {study["visible"][1]} detectable effects were named or put in a class, and
            {study["names"][0]} of {study["names"][1]} names given at 95 % or more are true. On a person only what
            changed between trials was ever checked. There the muscles explain less of the torque
            (R² {r2["base"]:.2f}) than posture, speed and the known load do ({r2["posture, speed and load"]:.2f}).
            Believe a name only where the page says that the model follows.""",
    }
    changed = numbers["changed"]
    needed = ", ".join(f"after {count} trials in {orders}" for count, orders in changed["trials_needed"].items())
    texts["trials_needed"] = f"""
        **Trials needed.** Trials were added one by one in 20 orders of the loads (1.25 kg told for all, electrodes
        said to have stayed). The load is named, and nothing else, {needed}."""
    worst = " and ".join(f"{r2:.3f} from {split}" for split, r2 in numbers["held_out"]["lowest"].items())
    texts["held_out_lowest"] = f"""
        The lowest R² of the network with 1 scale and EMG over weight on any trial and by any seed is {worst}."""
    tables = {
        "held_out": numbers["held_out"]["by_question"],
        "held_out_differences": numbers["held_out"]["differences"],
        "changed_person": changed["person"],
        "changed_arms": changed["arms"],
        "changed_arms_of": changed["arms_of"],
        "results": _results(numbers),
        "torque": _predictors("R² of the torque, held-out trials", r2, 2),
        "ahead": _predictors("error after 0.5 s [deg]", ahead, 1),
        "networks": _networks_table(numbers),
        "rivals": _rivals(numbers),
    }
    return {name: _unwrapped(text) for name, text in texts.items()} | tables


def _unwrapped(text: str) -> str:
    """A text with a line for each of its points."""
    return re.sub(r"\s*\n\s*(?!- )", " ", dedent(text).strip())


def _titles(verdict: dict[str, Any], between: str) -> str:
    return between.join(TITLES[name] for name in verdict["effects"])


def _missing(verdict: dict[str, Any]) -> str:
    """What a verdict says is missing, in words."""
    if not verdict["effects"]:
        return ANSWERS.get(verdict["kind"], str(verdict["kind"]))
    return _titles(verdict, ", ") + ", and more" * (verdict["kind"] == "partial")


def _network(numbers: dict[str, Any], dataset: str, model: str = "base") -> Any:
    """The network of a dataset with the fewest scales, but for the paper's method; None where there is none."""
    found = [n for n in numbers["networks"] if (n["dataset"], n["model"]) == (dataset, model) and not n["baseline"]]
    return min((n for n in found if not n["recipe"].startswith("paper")), key=lambda n: n["scales"], default=None)


def _results(numbers: dict[str, Any]) -> str:
    rows = []
    for name, text in DATASETS.items():
        verdict = numbers["verdicts"][name]
        models = dict.fromkeys(("base", verdict["model"]))
        trained = [n for model in models if (n := _network(numbers, name, model))]
        rows.append(
            [
                text,
                _missing(verdict),
                "follows no whole trial"
                if verdict["horizon_s"]
                else " → ".join(_small(error, "") for error in dict.fromkeys(verdict["errors_deg"])),
                " → ".join(_small(n["deg"], "") for n in trained),
                " → ".join(_r2(n["r2"]) for n in trained),
            ]
        )
    return markdown(["trials", "what is missing", "model [deg]", "network [deg]", "R² of the network"], rows)


def _small(value: float, unit: str) -> str:
    """Two digits, and no more zeros than people read."""
    number = f"{value:.1f}" if value >= 1 else f"{value:#.2g}" if value >= 0.001 else "under 0.001"
    return f"{number} {unit}".strip()


def _r2(value: float) -> str:
    return f"{value:.4f}" if value < 0.99985 else "over 0.9998"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _networks_table(numbers: dict[str, Any]) -> str:
    heads = ["dataset", "model", "recipe", "scales", "test R²", "error [deg]"]
    heads += ["in the band", "worst parameter [%]", "more scales"]
    rows, best = [], {}
    for n in numbers["networks"]:
        best[n["dataset"], n["model"]] = max(best.get((n["dataset"], n["model"]), -np.inf), n["r2"])
    for n in numbers["networks"]:
        r2 = _r2(n["r2"])
        r2 = f"**{r2}**" if n["r2"] == best[n["dataset"], n["model"]] else r2
        band = "" if n["band"] is None else _percent(n["band"])
        worst = "" if n["parameter_error_pct"] is None else f"{n['parameter_error_pct']:.2g}"
        values = [r2, f"{n['deg']:.3g}", band, worst, n["more_scales"]]
        rows.append([n["dataset"], n["model"], n["recipe"], str(n["scales"]), *values])
    return markdown(heads, rows)


def _predictors(score: str, values: dict[str, float], digits: int) -> str:
    """The muscle model, as pictures call it, and what stands beside it."""
    rows = [[described(name, TITLES), f"{value:.{digits}f}"] for name, value in values.items()]
    return markdown(["predictor", score], rows)


def _rivals(numbers: dict[str, Any]) -> str:
    """Who predicts the person best, whoever it is."""
    rows = [n for n in numbers["networks"] if (n["dataset"], n["model"]) == (PERSON, "base")]
    rivals, own = ({n["recipe"]: n["r2"] for n in rows if n["baseline"]}, _network(numbers, PERSON))
    rivals = {RIVALS.get(name, name): r2 for name, r2 in rivals.items()}
    name = max(rivals, key=lambda rival: rivals[rival])
    found = "The network here does best" if own["r2"] > rivals[name] else f"A plain predictor, {name}, does best"
    found = f"{found}, {_r2(own['r2'])} against {_r2(rivals[name])} of {name}"
    others = ", ".join(f"{rival} {r2:.2f}" for rival, r2 in rivals.items() if rival != name)
    return f"- **Against plain predictors.** {found} (R² on the two trials, medians over seeds); {others}."


def filled(text: str, parts: dict[str, str]) -> str:
    """A page with its blocks filled."""
    return BLOCK.sub(lambda found: f"{found[1]}{parts[found[2]]}\n{found[3]}", text)


def pages() -> list[Path]:
    """Those that have blocks."""
    return [path for path in (ROOT / "README.md", *sorted(ROOT.glob("docs/*.md"))) if BLOCK.search(path.read_text())]


def photograph(page: Path) -> None:
    """The top of a verdict page as a browser shows it, where there is one."""
    browser = which("chromium") or which("google-chrome")
    if browser is None:
        print("docs/page.png stays: there is no Chromium")
        return
    with tempfile.TemporaryDirectory() as folder:
        options = [
            "--headless",
            "--no-sandbox",
            "--hide-scrollbars",
            "--window-size=1100,1250",
            f"--user-data-dir={folder}",
        ]
        command = [browser, *options, f"--screenshot={ROOT / 'docs/page.png'}", page.resolve().as_uri()]
        subprocess.run(command, check=True, capture_output=True)


def main(results: Path) -> None:
    numbers = collect(results)
    NUMBERS.write_text(json.dumps(numbers, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    parts = blocks(numbers)
    for page in pages():
        page.write_text(filled(page.read_text(encoding="utf-8"), parts), encoding="utf-8")
    for name, source in PICTURES.items():
        copyfile(results / "figures" / source, ROOT / "docs" / name)
    photograph(results / f"diagnosis/{SIMULATOR}/verdict.html")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "results"))
