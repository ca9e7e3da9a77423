"""What MLflow shows of the files in results/: a run for each dataset, and below it one for each seed of each network.

Nothing here knows MLflow. The run of a dataset holds its verdict and, of all its networks, the scores of the one with
the best R2 on validation trials; the runs of the seeds hold their own scores and what happened in each epoch.
"""

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from myowave.data.json_files import read_json
from myowave.diagnosis.report.tell import tell
from myowave.learning.tables import join_histories
from myowave.scores import median_over_seeds, read_evaluation

COORDINATES = ["dataset", "model", "recipe", "scales"]
CURVE_POINTS = 60  # a curve in the browser needs no more


@dataclass(frozen=True)
class RunContent:
    """What goes into one run, which begins and ends when its results were made."""

    key: str  # what the run stands for; the same when its files are made again
    name: str
    params: Mapping[str, Any]
    metrics: Mapping[str, float]
    description: str
    finished: float  # s since 1970
    duration_s: float = 0.0
    curves: pd.DataFrame = field(default_factory=pd.DataFrame)  # indexed by epoch over all scales
    artifacts: Mapping[str, Path] = field(default_factory=dict)  # files by their path within the run


def digest(runs: Iterable[RunContent]) -> str:
    found = hashlib.sha256()
    for run in runs:
        shown = (run.key, run.name, dict(run.params), dict(run.metrics), run.description, run.curves.to_csv())
        found.update(repr(shown).encode())
        for name, path in run.artifacts.items():
            found.update(name.encode() + path.read_bytes())
    return found.hexdigest()[:16]


def read_results(results: Path, recipes: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[RunContent, ...]]:
    """The runs of each dataset that has a verdict or networks, that of the dataset first; networks are those of these
    recipes and baselines, settings by name. An OSError or ValueError for a file that is missing or cut short."""
    folders = [path.parent for path in sorted(results.glob("learning/*/*/*/*-scale/evaluation.csv"))]
    networks = [folder for folder in folders if folder.parent.name in recipes]
    networks.sort(key=lambda folder: "kind" in recipes[folder.parent.name])  # what has a kind is a baseline
    verdicts = {path.parent.name for path in results.glob("diagnosis/*/verdict.json")}
    for dataset in sorted(verdicts | {folder.parts[-4] for folder in networks}):
        own = {folder: read_evaluation(folder / "evaluation.csv") for folder in networks if folder.parts[-4] == dataset}
        seeds = [run for folder, table in own.items() for run in _seeds(folder, table, recipes[folder.parent.name])]
        yield (_overview(results, dataset, own), *seeds)


def _seeds(folder: Path, table: pd.DataFrame, recipe: Mapping[str, Any]) -> Iterator[RunContent]:
    curves = pd.DataFrame({"seed": []}) if "kind" in recipe else _curves(folder, int(table["scales"].iloc[0]))
    for _, row in table.iterrows():
        where = row[COORDINATES].to_dict()
        yield RunContent(
            key="{dataset}/{model}/{recipe}/{scales}-scale/seed-{seed}".format(**row),
            name="{dataset} {model} {recipe} {scales}-scale seed {seed}".format(**row),
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


def _overview(results: Path, dataset: str, networks: Mapping[Path, pd.DataFrame]) -> RunContent:
    """The run of a dataset: its verdict, the scores of its best network, tables and pictures."""
    diagnosis, pictures = results / "diagnosis" / dataset, results / "figures" / dataset
    made = [folder / "evaluation.csv" for folder in networks]
    files = {"/".join(path.parts[-4:]): path for path in made}
    files |= {f"figures/{file.relative_to(pictures)}": file for file in sorted(pictures.rglob("*.png"))}
    name, params, told = dataset, {"dataset": dataset}, []
    metrics: dict[str, float] = {}
    seconds = 0.0
    if (path := diagnosis / "verdict.json").exists():
        made.append(path)
        verdict = read_json(path)
        story, missing = tell(verdict), ", ".join(verdict["effects"])
        ladder = pd.read_csv(diagnosis / "ladder.csv").set_index("model").select_dtypes("number")
        name = ": ".join([dataset, story["label"], *([story["named"]] if missing else [])])
        params |= {"verdict": story["label"], "missing": missing or "-", "physics": verdict["model"]}
        metrics |= ladder.loc[verdict["model"]].to_dict()
        of_base = ladder["heldout_rmse_deg"].iloc[0]
        metrics |= {"base_heldout_rmse_deg": of_base, "missing_deg": verdict["missing_deg"]}
        told += [story["headline"], story["where"], story["which"], "The whole story is in verdict.html, attached."]
        files |= {file.name: file for file in (*diagnosis.glob("verdict.*"), *sorted(diagnosis.glob("*.csv")))}
    if networks:
        by_network = pd.concat(networks.values()).groupby(COORDINATES[1:], sort=False)
        scores = pd.DataFrame({where: median_over_seeds(seeds) for where, seeds in by_network}).T
        best = scores["val_r2"].fillna(-np.inf).idxmax()  # the first where none was validated; baselines come last
        params |= dict(zip(COORDINATES[1:], best, strict=True))
        metrics |= scores.loc[best].drop(["scales", "seed"]).dropna().to_dict()
        seconds = float(scores["seconds"].sum())
        shown = scores[["val_r2", "test_r2", "test_rmse_deg"]].rename_axis(COORDINATES[1:]).reset_index()
        told.append(f"Networks, medians over seeds:\n\n{shown.to_markdown(index=False, floatfmt='.4g')}")
    finished = max(path.stat().st_mtime for path in made)
    return RunContent(dataset, name, params, metrics, "\n\n".join(told), finished, seconds, artifacts=files)
