"""How fast is the training beside the program one would write first, what does it cost as the task grows, and how late
is a prediction?

The plain program (`PlainNetwork`) is one `nn.GRUCell` for each seed, stepped in a Python loop and differentiated by
autograd, on the same windows with the same loss, and moved by Adam; ours by the recipe's optimiser, whose time counts.
Where JAX is installed, the same cell in `lax.scan`, jitted, with all seeds at once, runs beside them (`jax_scan`).
Everything that is compared runs in turn within one process on one thread; each figure is the least processor time of
several rounds.

Writes results/benchmarks/learning.json and learning.png.
"""

import json
import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import jax_scan
import numpy as np
import torch
import yaml
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from torch import Tensor, nn

from myowave.data.simulate import simulate_trials
from myowave.data.trials import Trials
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.evaluation import predict_trials, r_squared
from myowave.learning.inputs import to_tensors
from myowave.learning.methods.rollout.training import BETAS, DATA_SEED, OPTIMISERS, RolloutLoss, clip_gradients
from myowave.learning.network import Architecture, Network, Scaling, initialise
from myowave.learning.optimisers import Adam, Soap
from myowave.learning.streaming.predictor import Predictor
from myowave.learning.task import Task
from myowave.learning.training import train_scale
from myowave.learning.windows import Corpus, Pieces, count_training_samples, count_windows
from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.physics.model import Model
from myowave.physics.simulation import channel_delays
from myowave.plotting import CYCLE, GREY, canvas, save, title
from myowave.settings import RolloutRecipe, Settings, parse_settings

OUT = Path("results/benchmarks")
ROUNDS = 6
SEEDS = (1, 5, 20)
BUDGETS = (50, 100, 200, 400)  # epochs
ENOUGH = 0.99  # test R2 of the worst of `TEAM` seeds
TEAM = 5
ADAM_RATE = 0.01  # at which Adam gets furthest
GROWTH = {  # what grows: values, the second of which is the default
    "seeds": (1, 5, 10, 20),
    "samples of a trial": (250, 500, 1000, 2000),
    "training trials": (2, 4, 8, 16),
    "history steps": (4, 8, 16, 32),
    "hidden units": (25, 50, 100, 200),
}


def main() -> None:
    torch.set_num_threads(1)
    settings = parse_settings(yaml.safe_load(Path("config.yaml").read_text(encoding="utf-8")))
    model, recipe = build_model("base", settings.physics.of_arm("paper")), settings.learning.recipes["rollout"]
    trials, _ = simulate_trials("case1", settings.data.datasets["case1"], model, catalogue())
    result: dict = {"machine": describe_machine()}
    result["training"] = compare_training(trials, recipe)
    result["growth"] = measure_growth(recipe)
    reached, checkpoint = compare_time_to_accuracy(trials, model, recipe, settings)
    result["time_to_accuracy"] = reached
    result["latency_ms"] = measure_latency(checkpoint, trials)
    OUT.mkdir(parents=True, exist_ok=True)
    (OUT / "learning.json").write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    save(draw_growth(result["growth"]), OUT / "learning.png")
    show(result)


# ------------------------------------------------------------------------------------------ what is measured


@dataclass
class Ours:
    """Epochs of our training, all seeds at once, without what comes once a run: physics and validation."""

    loss: RolloutLoss
    weights: list[Tensor]
    optimiser: Adam | Soap

    @classmethod
    def of(cls, trials: Trials, recipe: RolloutRecipe, seeds: int, device: str = "cpu") -> "Ours":
        network, corpus = prepare(trials, recipe, seeds, device)
        loss = RolloutLoss(network, corpus, recipe, round(recipe.rollout_s / trials.dt), range(seeds))
        weights = list(network.weights.values())
        return cls(loss, weights, OPTIMISERS[recipe.optimiser](weights, BETAS))

    def epoch(self) -> None:
        self.optimiser.zero_grad()
        self.loss.backward()
        clip_gradients(self.weights)
        self.optimiser.move(ADAM_RATE)  # an epoch takes as long at any rate


class PlainNetwork(nn.Module):
    """The same network for one seed as one would write it first."""

    def __init__(self, architecture: Architecture, scaling: Scaling, history: int) -> None:
        super().__init__()
        self.cell = nn.GRUCell(architecture.inputs + architecture.features, architecture.hidden)
        self.head = nn.Linear(architecture.hidden, 1)
        self.scaling, self.history = scaling, history

    def forward(self, x: Tensor, z: Tensor, v: Tensor) -> Tensor:
        """Predictions (B, K - m) from inputs (B, K, X) and history (B, m)."""
        hidden = x.new_zeros(len(x), self.cell.hidden_size)
        unknown, predicted = x.new_zeros(len(x), 2), []
        for n in range(x.shape[1]):
            if n < self.history:
                zn, vn = z[:, n], v[:, n]
            else:
                current = self.cell(torch.cat([x[:, n], unknown], dim=1), hidden)
                vn = vn + self.scaling.bend * self.head(current)[:, 0]
                zn = zn + self.scaling.step * vn
                predicted.append(zn)
            hidden = self.cell(torch.cat([x[:, n], torch.stack([zn, vn], dim=1)], dim=1), hidden)
        return torch.stack(predicted, dim=1)


class Plain:
    """Epochs of the plain program, one seed after the other."""

    def __init__(self, trials: Trials, recipe: RolloutRecipe, seeds: int, delays: tuple[float, ...] = ()) -> None:
        self.network, corpus = prepare(trials, recipe, 1, delays=delays)
        self.draw = begin_drawing(self.network, corpus, round(recipe.rollout_s / trials.dt))
        self.nets, self.optimizers = [], []
        for seed in range(seeds):
            torch.manual_seed(seed)
            self.nets.append(PlainNetwork(self.network.architecture, self.network.scaling, recipe.history_steps))
            self.optimizers.append(torch.optim.Adam(self.nets[-1].parameters(), lr=ADAM_RATE))

    def epoch(self, decay: float = 1.0) -> None:
        history, (x, z, v) = self.network.history, self.draw()
        for net, optimizer in zip(self.nets, self.optimizers, strict=True):
            optimizer.param_groups[0]["lr"] = decay * ADAM_RATE
            optimizer.zero_grad()
            loss = (net(x, z[0, :, :history], v[0, :, :history]) - z[0, :, history:]).square().mean()
            loss.backward()
            nn.utils.clip_grad_norm_(net.parameters(), 1.0)
            optimizer.step()

    @torch.no_grad()
    def test_r2(self, trials: Trials) -> float:
        """Worst R2 of the seeds on the test trial, running free."""
        rest, history = trials.select(trials.test), self.network.history
        corpus = corpus_of(self.network, rest, torch.tensor(rest.lengths))
        z, v = corpus.z[0, :, :history], corpus.v[0, :, :history]
        measured = torch.from_numpy(rest.angle)[:, history:]
        scores = [r_squared(measured, self.network.to_rad(net(corpus.x, z, v))).mean() for net in self.nets]
        return float(min(scores))


def prepare(
    trials: Trials, recipe: RolloutRecipe, seeds: int, device: str = "cpu", delays: tuple[float, ...] = ()
) -> tuple[Network, Corpus]:
    """Fresh weights, and the training part of the trials, their EMG late by `delays` [s], which cost no time."""
    train = trials.select(trials.train)
    architecture = Architecture(recipe.method, recipe.hidden, len(trials.channels), recipe.history_steps, delays=delays)
    weights = initialise(architecture, range(seeds))
    network = Network(architecture, Scaling.of(train), weights).trainable(torch.device(device))
    usable = torch.tensor(count_training_samples(train, recipe.validation_fraction, recipe.history_steps))
    return network, corpus_of(network, train, usable)


def corpus_of(network: Network, trials: Trials, usable: Tensor) -> Corpus:
    emg, angle = to_tensors(trials, network.device)
    return Corpus.of(network, emg, angle.unsqueeze(0), trials.dt, usable)


def begin_drawing(network: Network, corpus: Corpus, steps: int) -> Callable[[], tuple[Tensor, Tensor, Tensor]]:
    """What draws the windows of one epoch after the other: x (B, K, X), z and v (1, B, K)."""
    count, random = count_windows(corpus.usable, steps), torch.Generator().manual_seed(DATA_SEED)
    return lambda: corpus.cut(Pieces.draw(corpus.usable, count, network.history + steps, random))


def race(runners: Mapping[str, Callable[[], None]], rounds: int = ROUNDS) -> dict[str, float]:
    """Least processor time [s] of each, run in turn; the first round warms up."""
    best = dict.fromkeys(runners, float("inf"))
    for i in range(rounds + 1):
        for name, run in runners.items():
            begin = time.process_time()
            run()
            spent = time.process_time() - begin
            if i:
                best[name] = min(best[name], spent)
    return best


# ------------------------------------------------------------------------------------------ measurements


def compare_training(trials: Trials, recipe: RolloutRecipe) -> dict:
    """Epochs of both programs and the machine's matrix products, in turn."""
    matrix = torch.randn(512, 512)
    runners = {f"ours {s}": Ours.of(trials, recipe, s).epoch for s in SEEDS}
    runners |= {f"plain {s}": Plain(trials, recipe, s).epoch for s in SEEDS[:2]}
    if jax_scan.is_there():
        runners |= {f"jax {s}": begin_jax(trials, recipe, s).epoch for s in SEEDS}
    runners["product"] = lambda: [torch.mm(matrix, matrix) for _ in range(20)]
    seconds = race(runners)
    machine = 20 * 2 * 512**3 / seconds["product"] / 1e9
    plain = seconds[f"plain {SEEDS[1]}"] / SEEDS[1]
    rows = {}
    for s in SEEDS:
        ours = seconds[f"ours {s}"]
        rate = count_operations(trials, recipe, s) / ours / 1e9
        rows[str(s)] = {
            "ours_epoch_s": ours,
            "ours_seed_epochs_per_s": s / ours,
            "plain_seed_epochs_per_s": 1 / (seconds[f"plain {s}"] / s if s in SEEDS[:2] else plain),
            "times_faster": (seconds[f"plain {s}"] if s in SEEDS[:2] else plain * s) / ours,
            "jax_seed_epochs_per_s": s / seconds[f"jax {s}"] if f"jax {s}" in seconds else None,
            "matrix_gflop_per_s": rate,
            "share_of_matrix_rate": rate / machine,
        }
    return {"seeds": rows, "machine_gflop_per_s": machine}


def begin_jax(trials: Trials, recipe: RolloutRecipe, seeds: int) -> jax_scan.JaxScan:
    """The same network in JAX, whose loss on a first draw of windows is that of our definition."""
    network, corpus = prepare(trials, recipe, seeds)
    scan = jax_scan.JaxScan(network, begin_drawing(network, corpus, round(recipe.rollout_s / trials.dt)), ADAM_RATE)
    missed = jax_scan.compare_with_definition(scan, network)
    assert missed < 1e-4, f"the program in JAX computes another loss, by {missed:.1e}"
    return scan


def count_operations(trials: Trials, recipe: RolloutRecipe, seeds: int) -> float:
    """Floating-point operations of the matrix products of an epoch: forward, and twice as many back."""
    steps = round(recipe.rollout_s / trials.dt)
    usable = count_training_samples(trials.select(trials.train), recipe.validation_fraction, recipe.history_steps)
    samples = count_windows(torch.tensor(usable), steps) * (steps + recipe.history_steps)
    gates = 3 * recipe.hidden
    forward = 2 * samples * (gates * (recipe.hidden + len(trials.channels) + 2) + recipe.hidden)
    return 3.0 * seeds * forward


def measure_growth(recipe: RolloutRecipe) -> dict:
    """Seconds of an epoch as one thing grows and the others stay, all points in turn; and the exponent of growth."""
    defaults = {name: values[1] for name, values in GROWTH.items()}
    runners = {}
    for name, values in GROWTH.items():
        for value in values:
            at = {**defaults, name: value}
            changed = recipe.model_copy(update={"history_steps": at["history steps"], "hidden": at["hidden units"]})
            made_up = make_up(at["training trials"], at["samples of a trial"])
            runners[f"{name}={value}"] = Ours.of(made_up, changed, at["seeds"]).epoch
    seconds = race(runners, rounds=4)
    growth = {}
    for name, values in GROWTH.items():
        cost = [seconds[f"{name}={value}"] for value in values]
        exponent = np.polyfit(np.log(values), np.log(cost), 1)[0]
        growth[name] = {"values": list(values), "epoch_s": cost, "exponent": float(exponent)}
    return growth


def make_up(trials: int, samples: int) -> Trials:
    """Trials of noise, one more to test: an epoch costs the same whatever is in them."""
    random = np.random.default_rng(0)
    names = [str(i) for i in range(trials + 1)]
    return Trials.from_sequences(
        dataset="made_up",
        dt=0.0316227766,
        names=names,
        channels=["emg_biceps", "emg_triceps"],
        emg=[random.random((samples, 2)) for _ in names],
        angle=[random.random(samples) for _ in names],
        test=names[-1:],
    )


def compare_time_to_accuracy(
    trials: Trials, model: Model, recipe: RolloutRecipe, settings: Settings
) -> tuple[dict, Checkpoint]:
    """Processor time until all seeds predict the test trial with R2 of `ENOUGH`, in turn with the same epochs.

    A run has a fixed number of epochs, over which the cosine goes down; the shortest run that is good enough counts.
    Ours is all of it: identification, simulated motion, validation. The test trial only scores, it chooses nothing
    else. The plain program stops trying once it has had the largest budget.
    """
    wanted = settings.data.datasets["case1"].identify
    result: dict = {"ours": {"runs": []}, "plain": {"runs": []}}
    checkpoint = None
    for budget in BUDGETS:
        shorter = recipe.model_copy(update={"epochs": budget})
        if "seconds" not in result["ours"]:
            begin = time.process_time()
            task = Task({0: trials}, model, shorter, wanted, total=1, seeds=range(TEAM))
            *_, last = train_scale(task, level=0)
            spent, checkpoint = time.process_time() - begin, last.checkpoint
            note(result["ours"], budget, spent, score(checkpoint, trials))
        if "seconds" not in result["plain"]:
            delays = channel_delays(model, trials.channels) if recipe.emg_input == "delayed" else ()
            plain, begin = Plain(trials, shorter, TEAM, delays), time.process_time()
            for epoch in range(budget):
                plain.epoch(decay(epoch, budget))
            note(result["plain"], budget, time.process_time() - begin, plain.test_r2(trials))
    ours, plain_s = result["ours"].get("seconds"), result["plain"].get("seconds")
    if ours:
        result["times_faster"] = (plain_s or result["plain"]["runs"][-1]["seconds"]) / ours
        result["at_least"] = plain_s is None
    return result, checkpoint


def decay(epoch: int, epochs: int) -> float:
    """The recipe's cosine with its warm-up."""
    return 0.5 * (1 + np.cos(np.pi * epoch / epochs)) * min(1.0, (epoch + 1) / 20)


def note(side: dict, epochs: int, seconds: float, r2: float) -> None:
    side["runs"].append({"epochs": epochs, "seconds": seconds, "test_r2": r2})
    if r2 >= ENOUGH:
        side["seconds"] = seconds


def score(checkpoint: Checkpoint, trials: Trials) -> float:
    t, history = trials.index(trials.test)[0], checkpoint.recipe["history_steps"]
    predicted = predict_trials(checkpoint, trials)[:, t, history:]
    return float(r_squared(torch.from_numpy(trials.angle)[t, history:], predicted).min())


def measure_latency(checkpoint: Checkpoint, trials: Trials, seeds: Sequence[int] = (1, TEAM)) -> dict:
    """Time [ms] from a sample of EMG to its angle, 4000 samples.

    `median` and `p99` are by the clock on the wall; `p99_processor` leaves out what other programs took meanwhile.
    """
    result = {}
    for count in seeds:
        some = {name: value[:count] for name, value in checkpoint.weights.items()}
        copies = Checkpoint(**{**vars(checkpoint), "weights": some, "seeds": tuple(range(count))})
        predictor, rest = Predictor(copies), float(trials.angle[0, 0])
        wall, processor = [], []
        for sample in np.tile(trials.emg[0], (8, 1)).tolist():
            begin, begin_here = time.perf_counter(), time.thread_time()
            predictor.step(sample, angle=rest)
            processor.append(1e3 * (time.thread_time() - begin_here))
            wall.append(1e3 * (time.perf_counter() - begin))
        median, late = np.percentile(wall, [50, 99])
        own = np.percentile(processor, 99)
        result[str(count)] = {"median": float(median), "p99": float(late), "p99_processor": float(own)}
    return result


def describe_machine() -> dict:
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": names[0] if names else platform.processor(),
        "cores": os.cpu_count(),
        "load_average": round(os.getloadavg()[0], 2),
        "torch": torch.__version__,
        "threads": torch.get_num_threads(),
    }


# ------------------------------------------------------------------------------------------ what is shown


def draw_growth(growth: Mapping[str, Mapping]):
    """Cost of an epoch relative to the default, against the relative size of what grows."""
    figure, axes = canvas(1, 1, width=8.5, height=4.6)
    axis = axes[0, 0]
    for (name, measured), color, marker in zip(growth.items(), CYCLE, "osD^v", strict=False):
        values, cost = np.array(measured["values"]), np.array(measured["epoch_s"])
        label = f"{name} (default {values[1]}): power {measured['exponent']:.2f}"
        axis.loglog(values / values[1], cost / cost[1], marker=marker, color=color, label=label)
    reach = np.array([0.25, 4.0])
    axis.loglog(reach, reach, linestyle="--", color=GREY, linewidth=1.0, label="in proportion")
    axis.set(xlabel="size relative to the default [-]", ylabel="time of an epoch relative to the default [-]")
    for scale in (axis.xaxis, axis.yaxis):
        scale.set_major_locator(LogLocator(base=2))
        scale.set_minor_locator(NullLocator())
        scale.set_major_formatter(FuncFormatter(lambda size, _: f"{size:g}"))
    axis.legend()
    above = [f"{name} (power {at['exponent']:.2f})" for name, at in growth.items() if at["exponent"] > 1]
    but = f", but for {' and '.join(above)}" if above else ""
    title(figure, f"An epoch costs less than in proportion to what grows{but}")
    return figure


def show(result: Mapping) -> None:
    console, machine = Console(), result["machine"]
    busy = f"; {machine['load_average']} jobs were running at the start" if machine["load_average"] > 1 else ""
    console.print(f"{machine['processor']}, one thread{busy}; the JSON and the figure are in {OUT}/")
    table = Table(
        "seeds", escape("epoch [ms]"), "seed-epochs/s", "plain program", "times faster", "JAX scan", "matrix rate"
    )
    for seeds, row in result["training"]["seeds"].items():
        table.add_row(
            seeds,
            f"{1e3 * row['ours_epoch_s']:.1f}",
            f"{row['ours_seed_epochs_per_s']:.1f}",
            f"{row['plain_seed_epochs_per_s']:.1f}",
            f"{row['times_faster']:.1f}",
            f"{row['jax_seed_epochs_per_s']:.1f}" if row["jax_seed_epochs_per_s"] else "-",
            f"{row['share_of_matrix_rate']:.0%}",
        )
    console.print(table)
    if not jax_scan.is_there():
        console.print(jax_scan.HOW_TO)
    table = Table("epochs", *(escape(f"{side} {what}") for side in ("ours", "plain") for what in ("[s]", "test R2")))
    runs = [{run["epochs"]: run for run in result["time_to_accuracy"][side]["runs"]} for side in ("ours", "plain")]
    for budget in sorted({*runs[0], *runs[1]}):
        cells = []
        for side in runs:
            run = side.get(budget)
            cells += [f"{run['seconds']:.1f}", f"{run['test_r2']:.4f}"] if run else ["-", "-"]
        table.add_row(str(budget), *cells)
    console.print(table)
    reached = result["time_to_accuracy"]
    if "times_faster" in reached:
        least = "at least " if reached["at_least"] else ""
        faster = f"{least}{reached['times_faster']:.1f} times faster"
        console.print(f"test R2 {ENOUGH} in case 1, every one of {TEAM} seeds: {faster}")
    else:
        console.print(f"test R2 {ENOUGH} in case 1 is not reached within {BUDGETS[-1]} epochs")
    for name, measured in result["growth"].items():
        console.print(f"cost grows with the power {measured['exponent']:.2f} of {name}")
    for seeds, late in result["latency_ms"].items():
        console.print(
            f"predict, {seeds} seed(s): median {late['median']:.3f} ms, 99th percentile {late['p99']:.3f} ms "
            f"({late['p99_processor']:.3f} ms of processor time)"
        )


if __name__ == "__main__":
    main()
