"""What MLflow shows of the files in results/: a run for each dataset, and below it one for each seed of each network.

Nothing here knows MLflow. The run of a dataset holds its verdict and, of all its networks, the scores of the one with
the best R2 on validation trials; the runs of the seeds hold their own scores and what happened in each epoch.
"""

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from myowave.diagnosis.report.tell import tell
from myowave.learning.tables import join_histories
from myowave.scores import median_over_seeds

COORDINATES = ("dataset", "model", "recipe", "scales")
CURVE_POINTS = 60  # a curve in the browser needs no more


@dataclass(frozen=True)
class RunContent:
    """What goes into one run.

    Args:
        key: what the run stands for, beginning with its dataset; the same when its files are made again.
        finished: when its results were written [s since 1970]; they took `duration_s` [s], where it is known.
        curves: indexed by epoch over all scales; columns are names of metrics.
        artifacts: files by their path within the run.
    """

    key: str
    name: str
    params: Mapping[str, Any]
    metrics: Mapping[str, float]
    description: str
    finished: float
    duration_s: float = 0.0
    curves: pd.DataFrame = field(default_factory=pd.DataFrame)
    artifacts: Mapping[str, Path] = field(default_factory=dict)


def digest(runs: Iterable[RunContent]) -> str:
    """Digest of all that runs show."""
    found = hashlib.sha256()
    for run in runs:
        shown = (run.key, run.name, dict(run.params), dict(run.metrics), run.description, run.curves.to_csv())
        found.update(repr(shown).encode())
        for name, path in run.artifacts.items():
            found.update(name.encode() + path.read_bytes())
    return found.hexdigest()[:16]


def read_results(results: Path, recipes: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[RunContent, ...]]:
    """The runs of each dataset that has a verdict or networks, that of the dataset first.

    Args:
        results: the folder `results`.
        recipes: settings of recipes and baselines by name; networks of others are left out.

    Raises:
        OSError, ValueError: for a file that is missing or cut short.
    """
    networks: dict[str, list[Path]] = {}
    for path in sorted(results.glob("learning/*/*/*/*-scale/evaluation.csv")):
        if path.parts[-3] in recipes:
            networks.setdefault(path.parts[-5], []).append(path.parent)
    verdicts = {path.parent.name for path in results.glob("diagnosis/*/verdict.json")}
    for dataset in sorted(verdicts | set(networks)):
        folders = sorted(networks.get(dataset, []), key=lambda folder: "kind" in recipes[folder.parent.name])
        seeds = [run for folder in folders for run in _seeds(folder, recipes[folder.parent.name])]
        yield (_overview(results, dataset, folders), *seeds)


def _seeds(folder: Path, recipe: Mapping[str, Any]) -> Iterator[RunContent]:
    """A run for each seed of the network in a folder."""
    table = pd.read_csv(folder / "evaluation.csv")
    # What has a kind is a baseline, which leaves no history.
    curves = pd.DataFrame({"seed": []}) if "kind" in recipe else _curves(folder, int(table["scales"].iloc[0]))
    for _, row in table.iterrows():
        where = {name: row[name] for name in COORDINATES}
        name = "{dataset} {model} {recipe} {scales}-scale".format(**where)
        yield RunContent(
            key="{dataset}/{model}/{recipe}/{scales}-scale".format(**where) + f"/seed-{row['seed']}",
            name=f"{name} seed {row['seed']}",
            params={**where, **recipe, "seed": row["seed"]},
            metrics=row.drop([*COORDINATES, "seed"]).to_dict(),
            description=f"Made by `snakemake --cores 2 results/learning/{'/'.join(folder.parts[-4:])}/evaluation.csv`.",
            finished=(folder / "evaluation.csv").stat().st_mtime,
            duration_s=row["seconds"],
            curves=curves[curves["seed"] == row["seed"]].drop(columns="seed"),
        )


def _curves(folder: Path, scales: int) -> pd.DataFrame:
    """Histories of all scales, thinned out; indexed by the epoch over all scales."""
    history = join_histories(folder, scales).select_dtypes("number")
    epochs = history["epoch"].drop_duplicates()
    shown = epochs.iloc[:: max(1, len(epochs) // CURVE_POINTS)]
    thin = history[history["epoch"].isin([*shown, epochs.max()])].set_index("epoch")
    return thin.rename(columns=lambda name: name if name == "seed" else f"curve/{name}")


def _overview(results: Path, dataset: str, networks: list[Path]) -> RunContent:
    """The run of a dataset: its verdict, the scores of its best network, tables and pictures."""
    diagnosis, pictures = results / "diagnosis" / dataset, results / "figures" / dataset
    made = [folder / "evaluation.csv" for folder in networks]
    files = {"/".join(path.parts[-4:]): path for path in made}
    params, told, name = {"dataset": dataset}, [], dataset
    metrics: dict[str, float] = {}
    seconds = 0.0
    if (path := diagnosis / "verdict.json").exists():
        made.append(path)
        verdict = json.loads(path.read_text(encoding="utf-8"))
        missing = ", ".join(verdict["effects"])
        ladder = pd.read_csv(diagnosis / "ladder.csv").set_index("model").select_dtypes("number")
        name = f"{dataset}: {verdict['verdict']} {missing}".strip()
        params |= {"verdict": verdict["verdict"], "missing": missing or "-", "physics": verdict["model"]}
        metrics |= ladder.loc[verdict["model"]].to_dict()
        metrics |= {"base_heldout_rmse_deg": ladder["heldout_rmse_deg"].iloc[0]}
        metrics |= {key: verdict[key] for key in ("missing_deg", "missing_Nm") if key in verdict}
        story = tell(verdict)
        told += [story.headline, story.where, story.which, "The whole story is in verdict.html, attached."]
        files |= {file.name: file for file in (diagnosis / "verdict.html", path, *sorted(diagnosis.glob("*.csv")))}
    if networks:
        rows = pd.concat([pd.read_csv(folder / "evaluation.csv") for folder in networks])
        by_network = rows.groupby([*COORDINATES[1:]], sort=False)
        scores = pd.DataFrame({where: median_over_seeds(seeds) for where, seeds in by_network}).T
        best = scores["val_r2"].fillna(-np.inf).idxmax()  # the first where none was validated; baselines come last
        params |= dict(zip(COORDINATES[1:], best, strict=True))
        metrics |= scores.loc[best].drop(["scales", "seed"]).dropna().to_dict()
        seconds = float(scores["seconds"].sum())
        shown = scores[["val_r2", "test_r2", "test_rmse_deg"]].rename_axis(COORDINATES[1:]).reset_index()
        told.append(f"Networks, medians over seeds:\n\n{shown.to_markdown(index=False, floatfmt='.4g')}")
    files |= {f"figures/{file.relative_to(pictures)}": file for file in sorted(pictures.rglob("*.png"))}
    return RunContent(
        key=dataset,
        name=name,
        params=params,
        metrics=metrics,
        description="\n\n".join(told),
        finished=max(path.stat().st_mtime for path in made),
        duration_s=seconds,
        artifacts={name: path for name, path in files.items() if path.exists()},
    )
