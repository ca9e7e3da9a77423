"""The same training on a GPU and on one core: epochs per second of many seeds, and the networks that come out.

Without a GPU it says so. Where there is one, both are measured in turn, by the clock on the wall: a GPU works while the
processor waits.
"""

import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import torch
from learning import OUT, Ours, describe_machine
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from myowave.data.importing import import_trials
from myowave.data.json_files import write_json
from myowave.data.simulate import simulate_trials
from myowave.data.trials import Trials
from myowave.data.wavelets import decompose, thin_scales
from myowave.learning.evaluation import predict_trials, score_trials
from myowave.learning.task import Task
from myowave.learning.training import train_scales
from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.settings import RolloutRecipe, Settings, SimulatedDataset, read_settings

SEEDS = (5, 20, 100)
EPOCHS = 20  # that are timed
TRAININGS = (("case1", "rollout", 3), ("human_curls", "recorded", 1), ("case1", "paper_split", 1))
DEVICES = ("cpu", "cuda")


def main() -> None:
    torch.set_num_threads(1)
    if not torch.cuda.is_available():
        sys.exit("No GPU that torch can use; nothing was measured.")
    settings = read_settings([Path("config.yaml")])
    result: dict = {"gpu": torch.cuda.get_device_name(), "machine": describe_machine()}
    recipe, trials = settings.learning.recipes["rollout"], make_trials("case1", settings)
    assert isinstance(recipe, RolloutRecipe)
    result["epochs"] = [measure_epochs(trials, recipe, seeds) for seeds in SEEDS]
    show_epochs(result)
    result["trainings"] = [compare(*what, settings) for what in TRAININGS]
    show_trainings(result)
    write_json(result, OUT / "gpu.json")


def make_trials(dataset: str, settings: Settings) -> Trials:
    """Trials of a dataset of the settings, simulated or imported anew."""
    described = settings.data.datasets[dataset]
    if isinstance(described, SimulatedDataset):
        base = build_model("base", settings.physics_of(dataset))
        return simulate_trials(dataset, described, base, catalogue())[0]
    return import_trials(dataset, described)[0].trials


def measure_epochs(trials: Trials, recipe: RolloutRecipe, seeds: int) -> dict:
    """Seed-epochs per second of each device."""
    row: dict = {"seeds": seeds}
    thinned = trials.thinned(recipe.rate_hz)
    for device in DEVICES:
        ours = Ours.of(thinned, recipe, seeds, device)
        row[device] = seeds / timed(ours.epoch)
        row[f"{device}_gradient_ms"] = 1e3 * timed(ours.loss.backward)
        row[f"{device}_step_ms"] = 1e3 * timed(partial(ours.optimiser.move, 0.0))
    return row


def timed(step: Callable[[], object]) -> float:
    """Seconds of one of `EPOCHS` steps, after as many, all that the GPU was told to do in them done."""
    for _ in range(2):
        torch.cuda.synchronize()
        begin = time.perf_counter()
        for _ in range(EPOCHS):
            step()
        torch.cuda.synchronize()
        spent = time.perf_counter() - begin
    return spent / EPOCHS


def compare(dataset: str, recipe: str, total: int, settings: Settings) -> dict:
    """One training of the main job on both devices: seconds and test R2 of each seed."""
    row: dict = {"dataset": dataset, "recipe": recipe, "scales": total}
    parsed, trials = settings.learning.recipes[recipe], make_trials(dataset, settings)
    wavelet, wanted = settings.data.wavelet, settings.data.datasets[dataset].identify
    scales = thin_scales(decompose(trials, total - 1, wavelet.name), parsed.rate_hz, total - 1, wavelet.name)
    model = build_model("base", settings.physics_of(dataset))
    for device in DEVICES:
        task = Task(scales, model, parsed, wanted, total, range(settings.learning.seeds), device=torch.device(device))
        begin = time.perf_counter()
        *_, checkpoint = train_scales(task)
        row[f"{device}_s"] = time.perf_counter() - begin
        scores = score_trials(scales[0], predict_trials(checkpoint, scales[0]).cpu(), checkpoint.network.history)
        row[f"{device}_r2"], row[f"{device}_rmse_deg"] = scores["test_r2"], scores["test_rmse_deg"]
    return row


def show_epochs(result: dict) -> None:
    parts = (escape(f"{part} [ms]") for part in ("gradient", "step"))
    table = Table("seeds", "one core", result["gpu"], "times", *parts, title="seed-epochs per second")
    for row in result["epochs"]:
        rates = f"{row['cpu']:.0f}", f"{row['cuda']:.0f}", f"{row['cuda'] / row['cpu']:.1f}"
        parts = (f"{row[f'cpu_{part}_ms']:.1f} / {row[f'cuda_{part}_ms']:.1f}" for part in ("gradient", "step"))
        table.add_row(str(row["seeds"]), *rates, *parts)
    Console(width=140).print(table)


def show_trainings(result: dict) -> None:
    columns = "dataset", "recipe", "scales", "one core [s]", "GPU [s]", "test error [deg], one core", "GPU"
    table = Table(*map(escape, columns))
    for row in result["trainings"]:
        seconds = f"{row['cpu_s']:.1f}", f"{row['cuda_s']:.1f}"
        errors = (" ".join(f"{x:.3f}" for x in sorted(row[f"{device}_rmse_deg"])) for device in DEVICES)
        table.add_row(row["dataset"], row["recipe"], str(row["scales"]), *seconds, *errors)
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
