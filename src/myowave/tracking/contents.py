"""What MLflow shows of result files: runs with their parameters, numbers, curves, descriptions and attachments.

Nothing here knows MLflow. A group is a parent run and the runs below it; `from_model` and `from_sweep` read one from
the files of a trained model and of a sweep. In the table children are folded away and charts draw the parents, so
parents carry the medians, and all parameters are on both.
"""

import hashlib
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from myowave.learning.tables import join_histories
from myowave.scores import median_over_seeds

LEARNING = "Learning: how well is motion predicted?"
SWEEPS = "Sweeps: which settings are best?"
DIAGNOSIS = "Diagnosis: what does the model miss?"
EXPERIMENTS = {
    LEARNING: "A run for each dataset, physical model, recipe and number of scales, with the medians over its seeds; "
    "below it a run for each seed. Charts and table show the medians. Identification has seen the samples of val_r2.",
    DIAGNOSIS: "A run for each dataset with its verdict, page and figures; below it a run for each fitted model.",
    SWEEPS: "A run is a search for better settings of a recipe; below it are the settings tried.",
}
COORDINATES = ("dataset", "model", "recipe", "scales")
# A curve over numbers of scales: a point for each run, a line through those of one tag `line`. Its name is the title.
BY_SCALES = "test error in deg by number of scales"
CURVE_POINTS = 60  # a curve in the browser needs no more


@dataclass(frozen=True)
class TrainedModel:
    """The files of one model trained at some number of scales, all seeds.

    Args:
        folder: holds evaluation.csv and the histories of the scales.
        settings: the recipe it was trained with.
        figures: pictures to attach.
    """

    folder: Path
    settings: Mapping[str, Any]
    figures: Sequence[str | Path] = ()


@dataclass(frozen=True)
class Swept:
    """The files of one sweep.

    Args:
        folder: holds trials.csv, best.yaml, summary.md and test_scores.csv.
        figures: pictures to attach.
    """

    folder: Path
    figures: Sequence[str | Path] = ()


@dataclass(frozen=True)
class RunContent:
    """What goes into one run.

    Args:
        job_key: what the run stands for; the same when its files are made again.
        finished: when its results were written [s since 1970]; they took `duration_s` [s].
        curves: indexed by epoch over all scales; columns are names of metrics.
    """

    name: str
    job_key: str
    params: Mapping[str, Any]
    metrics: Mapping[str, float]
    description: str
    tags: Mapping[str, str]
    finished: float
    duration_s: float
    curves: pd.DataFrame = field(default_factory=pd.DataFrame)
    artifacts: Sequence[str | Path] = ()


@dataclass(frozen=True)
class RunGroup:
    """A parent run and those below it.

    Args:
        experiment: name of the experiment that they belong to.
        digest: of all that they are made of.
    """

    experiment: str
    digest: str
    parent: RunContent
    children: tuple[RunContent, ...]


def from_model(model: TrainedModel) -> RunGroup:
    """A run with the medians over the seeds, and below it a run for each seed."""
    table = pd.read_csv(model.folder / "evaluation.csv")
    where = {name: table[name].iloc[0] for name in COORDINATES}
    curves = _curves(model.folder, where["scales"])
    name = "{dataset} {model} {recipe} {scales}-scale".format(**where)
    job_key = "learning/{dataset}/{model}/{recipe}/{scales}-scale".format(**where)
    params = {**where, **model.settings, "seeds": len(table)}
    line = "{dataset} {model} {recipe}".format(**where)
    tags = {k: str(v) for k, v in where.items()} | {"group": name, "line": line}
    metrics = table.drop(columns=[*COORDINATES, "seed"]).select_dtypes("number")
    if "test_rmse_deg" not in metrics:  # written by an earlier version
        metrics["test_rmse_deg"] = metrics["test_mse"].pow(0.5).map(math.degrees)
    metrics.insert(0, "test_rmse_deg", metrics.pop("test_rmse_deg"))  # MLflow compares runs by the first
    medians = median_over_seeds(metrics)
    described = f"{where['model']} on {where['dataset']}, recipe {where['recipe']}, {where['scales']} scale(s)"
    made_by = f"Made by `snakemake --cores 2 {model.folder}/evaluation.csv`."
    finished, duration_s = (model.folder / "evaluation.csv").stat().st_mtime, float(table["seconds"].iloc[0])
    parent = RunContent(
        name=name,
        job_key=job_key,
        params=params,
        metrics=medians.to_dict() | metrics.std().add_suffix("_std").to_dict(),
        curves=_with_point(
            curves.drop(columns="seed").groupby(level="epoch").median(), where["scales"], medians["test_rmse_deg"]
        ),
        description=f"{described}: medians over {len(table)} seeds, which are the runs below.\n\n"
        f"{made_by}\n\n{_markdown(metrics.agg(['median', 'std']).T)}",
        tags=tags | {"kind": "median over seeds"},
        finished=finished,
        duration_s=duration_s,
        artifacts=(model.folder / "evaluation.csv", *model.figures),
    )
    children = [
        RunContent(
            name=f"{name} seed {seed}",
            job_key=f"{job_key}/seed-{seed}",
            params=params | {"seed": seed},
            metrics=metrics.loc[row].to_dict(),
            curves=_with_point(
                curves[curves["seed"] == seed].drop(columns="seed"), where["scales"], metrics.loc[row, "test_rmse_deg"]
            ),
            description=f"{described}, seed {seed}.\n\n{made_by}",
            tags=tags | {"kind": "seed"},
            finished=finished,
            duration_s=duration_s,
        )
        for row, seed in table["seed"].items()
    ]
    tables = [path for path in (model.folder / "evaluation.csv", model.folder / "parameters.csv") if path.exists()]
    files = [*tables, *sorted(model.folder.glob("history-*.parquet")), *model.figures]
    return RunGroup(LEARNING, _digest(dict(model.settings), files), parent, tuple(children))


def from_sweep(swept: Swept) -> RunGroup:
    """A run for the search, with the test scores of its best settings, and below it a run for each trial."""
    table = pd.read_csv(swept.folder / "trials.csv").fillna({"duration_s": 0.0})
    scores = pd.read_csv(swept.folder / "test_scores.csv")
    where = {name: scores[name].iloc[0] for name in COORDINATES}
    name = "{dataset} {model} {recipe} {scales}-scale".format(**where)
    job_key = "sweep/{dataset}/{model}/{recipe}/{scales}-scale".format(**where)
    tags = {k: str(v) for k, v in where.items()}
    errors = [c for c in table.columns if c == "error" or c.startswith(("after_", "seed_"))]
    settings = list(table.columns[table.columns.get_loc("error") + 1 : table.columns.get_loc("is_default")])
    settings = [c for c in settings if c not in errors]
    done = table[table["state"] == "complete"].sort_values("error")
    counts = table["state"].value_counts()
    by_setting = scores.groupby("setting")[["test_mse", "test_r2"]].median()
    made_by = "Made by `snakemake --cores 2 sweep`."
    summary = (swept.folder / "summary.md").read_text(encoding="utf-8")
    tables = [swept.folder / name for name in ("summary.md", "trials.csv", "test_scores.csv", "best.yaml")]
    finished = (swept.folder / "trials.csv").stat().st_mtime
    parent = RunContent(
        name=f"sweep of {name}",
        job_key=job_key,
        params={**where, **done.iloc[0][settings].to_dict(), "trials": len(table)},
        metrics={"held_out_error_deg": done["error"].iloc[0]}
        | {f"{setting}_{metric}": v for setting, row in by_setting.iterrows() for metric, v in row.items()}
        | {f"trials_{state}": count for state, count in counts.items()},
        description=f"Search for better settings of recipe {where['recipe']}: parameters are the best, trials are the "
        f"runs below.\n\n{made_by}\n\n{summary}\n\nTest scores (medians over seeds):\n\n{_markdown(by_setting)}",
        tags=tags | {"kind": "search"},
        finished=finished,
        duration_s=table["duration_s"].sum(),
        artifacts=(*tables, *swept.figures),
    )
    children = [
        RunContent(
            name=f"trial {row.trial:03d}" + (f" ({row.state})" if row.state != "complete" else ""),
            job_key=f"{job_key}/trial-{row.trial}",
            params={**where, **{c: getattr(row, c) for c in settings}},
            metrics={_metric_name(c): getattr(row, c) for c in errors},
            description=f"Trial {row.trial} of the sweep of {name}: {row.state}, {row.duration_s:.0f} s.\n\n{made_by}",
            tags=tags | {"kind": "trial", "state": row.state, "is_default": str(row.is_default)},
            finished=finished,
            duration_s=row.duration_s,
        )
        for row in table.itertuples()
    ]
    files = [*parent.artifacts]
    return RunGroup(SWEEPS, _digest({}, files), parent, tuple(children))


def from_diagnosis(folder: Path, pictures: Path, benchmark: Path) -> RunGroup:
    """A run with the verdict and its curves against the number of effects, and below it a run for each fitted model.

    Args:
        folder: holds verdict.json, verdict.html and the tables.
        pictures: holds the figures.
        benchmark: Snakemake's record of how long the job took, written at its end.
    """
    path = folder / "verdict.json"
    verdict = json.loads(path.read_text(encoding="utf-8"))
    ladder = pd.read_csv(folder / "ladder.csv").set_index("model")
    errors = ladder.select_dtypes("number")
    dataset, found = verdict["dataset"], verdict["model"]
    climbed = errors[~ladder["named"]]
    tags = {"dataset": dataset, "verdict": verdict["verdict"]}
    finished, duration_s = benchmark.stat().st_mtime, float(pd.read_csv(benchmark, sep="\t")["s"].iloc[0])
    files = [path, folder / "verdict.html", *sorted(folder.glob("*.csv")), *sorted(pictures.glob("*.png"))]
    added = set(verdict["effects"]) & set(found.split("+"))  # noise of the EMG is named and no part of the model
    add = " The page has the command that adds what was found." if added else ""
    page = f"The whole story is in `{folder}/verdict.html`, attached.{add}"
    columns = ["train_rmse_deg", "heldout_rmse_deg", "noise_deg", "missing_torque_Nm"]
    missing = name_causes(verdict)
    told = missing if verdict["verdict"] == "effect" else f"{verdict['verdict']} {missing}".strip()
    parent = RunContent(
        name=f"{dataset}: {told}",
        job_key=f"diagnosis/{dataset}",
        params={"dataset": dataset, "verdict": verdict["verdict"], "missing": missing or "-", "model": found},
        metrics=errors.loc[found].to_dict()
        | {"base_heldout_rmse_deg": errors["heldout_rmse_deg"].iloc[0]}
        | {name: verdict[name] for name in ("missing_deg", "missing_Nm") if name in verdict}
        | {f"share/{effect}": share for effect, share in verdict.get("shares", {}).items()},
        description=f"{verdict['sentence']}\n\n{verdict['where']}\n\n{_markdown(errors[columns])}\n\n{page}",
        tags=tags | {"kind": "verdict"},
        finished=finished,
        duration_s=duration_s,
        curves=climbed.set_index(climbed["effects"].rename("epoch"))[columns].add_prefix("curve/"),
        artifacts=files,
    )
    children = [
        RunContent(
            name=f"{dataset} {model}",
            job_key=f"diagnosis/{dataset}/{model}",
            params={"dataset": dataset, "model": model},
            metrics=row.to_dict() | _estimates(verdict["parameters"][model]),
            description=f"{model} fitted to the training trials of {dataset}.",
            tags=tags | {"kind": "model"},
            finished=finished,
            duration_s=duration_s,
        )
        for model, row in errors.iterrows()
    ]
    return RunGroup(DIAGNOSIS, _digest({}, files), parent, tuple(children))


def name_causes(verdict: Mapping[str, Any]) -> str:
    """What a verdict names, each with its share where there are several, those of a class joined by `or`."""
    classes = {members[0]: members for members in verdict.get("alternatives", [])}
    shares = verdict.get("shares", {}) if len(verdict.get("shares", {})) > 1 else {}
    named = []
    for effect in verdict["effects"]:
        share = f" {shares[effect]:.0%}" if effect in shares else ""
        named.append(" or ".join(classes.get(effect, [effect])) + share)
    return ", ".join(named)


def _estimates(parameters: Mapping[str, Mapping[str, float | None]]) -> dict[str, float | None]:
    """Value, standard error and, where it is known, true error of each parameter, as metrics."""
    return {
        f"parameter/{name}{suffix}": entry[key]
        for name, entry in parameters.items()
        for key, suffix in (("value", ""), ("se", "_se"), ("error_pct", "_error_pct"))
    }


def _with_point(curves: pd.DataFrame, scales: int, error: float) -> pd.DataFrame:
    """The curves, and one of a single point: the test error [deg] at the number of scales, for a line through them."""
    curves = curves.reindex(curves.index.union([scales]).rename("epoch"))
    return curves.assign(**{BY_SCALES: pd.Series({scales: error})})


def _metric_name(column: str) -> str:
    """`error` to `held_out_error_deg`, `scale_1` to `held_out_error_deg/scale_1`."""
    return "held_out_error_deg" if column == "error" else f"held_out_error_deg/{column}"


def _curves(folder: Path, scales: int) -> pd.DataFrame:
    """Histories of all scales, thinned out; indexed by the epoch over all scales."""
    history = join_histories(folder, scales).select_dtypes("number")
    epochs = history["epoch"].drop_duplicates()
    shown = epochs.iloc[:: max(1, len(epochs) // CURVE_POINTS)]
    thin = history[history["epoch"].isin([*shown, epochs.max()])].set_index("epoch")
    return thin.rename(columns=lambda name: name if name == "seed" else f"curve/{name}")


def _markdown(table: pd.DataFrame) -> str:
    known = table.dropna(how="all").astype(object)
    return known.where(known.notna(), None).to_markdown(floatfmt=".4g", missingval="")


def _digest(settings: Mapping[str, Any], files: Iterable[str | Path]) -> str:
    """Digest of everything that a group's runs are made of."""
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode())
    for path in files:
        digest.update(Path(path).read_bytes())
    return digest.hexdigest()[:16]
