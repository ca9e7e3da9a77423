"""Motion in real time: one sample of EMG in, one angle out, with nothing but what is past.

`Predictor` does one step in numpy, because a step is two dozen products of small matrices: torch would spend more time
on calling them than on computing them. `predict_lines` puts it behind lines of text.

Shapes: S seeds, C channels, X inputs, H hidden units, G gates, as in `network`.
"""

import csv
import math
from collections import deque
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import torch

from myowave.data.checks.ranges import EMG_LIMIT
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.network import encode_angle
from myowave.learning.prediction import Network

RATE_TOLERANCE = 0.01  # largest relative difference from the sampling interval of the training that counts as rounding


class Predictor:
    """Motion from a stream of EMG, for every seed.

    The angle must be known for the first `history` samples; from then on each call takes one sample of EMG and returns
    the angle. Equal to `predict_free_running` on the same samples.

    Args:
        checkpoint: a trained network.
        angles: the first `history` angles [rad], such as the resting angle repeated.
        seeds: numbers of the seeds to run; all by default.

    Raises:
        ValueError: for too few angles, or a seed that the checkpoint does not have.
    """

    def __init__(self, checkpoint: Checkpoint, angles: Sequence[float], seeds: Sequence[int] | None = None) -> None:
        network = Network.of(checkpoint)
        if len(angles) < network.history:
            raise ValueError(
                f"the network needs {network.history} known angles to start from, found {len(angles)}; "
                "repeat the resting angle if it was at rest."
            )
        seeds = checkpoint.seeds if seeds is None else seeds
        if unknown := sorted(set(seeds) - set(checkpoint.seeds)):
            raise ValueError(f"no seed {unknown} in the checkpoint; it has {list(checkpoint.seeds)}.")
        chosen = [checkpoint.seeds.index(seed) for seed in seeds]
        # Float64, and inputs rounded to float32 as everywhere: then any order of summation gives the batch's numbers.
        self._weights = {name: value[chosen].double().cpu().numpy() for name, value in network.weights.items()}
        self._architecture, self._scaling, self._units = network.architecture, network.scaling, network.units
        self._carried, self.history = network.carried, network.history
        self._mean, self._std = np.array(network.scaling.emg_mean), np.array(network.scaling.emg_std)
        self._channels, self._dt, self._count = checkpoint.channels, checkpoint.dt, 0
        given = torch.tensor(list(angles[: self.history]), dtype=torch.float64)
        self._angles = given.numpy()
        self._given = [
            (np.full((len(chosen), 1, 1), float(z)), np.full((len(chosen), 1, 1), float(v)))
            for z, v in zip(*encode_angle(network.scaling, given), strict=True)
        ]
        self._past: deque[np.ndarray] = deque(maxlen=self.history)  # what history cells saw, `windowed` alone
        self._start = np.zeros((len(chosen), 1, network.architecture.hidden))
        self._hidden, (self._z, self._v) = self._start, self._given[0]

    def step(self, emg: Sequence[float], where: str | None = None) -> np.ndarray:
        """The angle [rad] at the next sample for every seed, (S,), from its EMG (one number a channel).

        Args:
            where: what messages call the sample; its number by default.

        Raises:
            ValueError: for another number of channels, or EMG that is not normalised; the sample then does not count.
        """
        if len(emg) != len(self._mean):
            raise ValueError(f"a sample of EMG has {len(emg)} numbers; the network takes {len(self._mean)} channels.")
        n, weights = self._count, self._weights
        _check_emg(self._channels, emg, where or f"sample {n + 1}")
        driven = self._encode(emg) @ weights["input"] + weights["bias"]
        if n >= self.history:
            recurrent = self._remember()
            output = self._cell(driven, recurrent) @ weights["output"] + weights["output_bias"]
            self._move(output)
        else:
            self._z, self._v = self._given[n]
        features = np.concatenate((self._z, self._v), axis=-1) if self._architecture.increments else self._z
        seen = driven + features @ weights["angle"]
        if self._carried:
            self._hidden = self._cell(seen, recurrent if n >= self.history else self._hidden @ weights["hidden"])
        else:
            self._past.append(seen)
        self._count += 1
        if n < self.history:
            return np.full(len(self._z), self._angles[n])
        return self._z[:, 0, 0] * self._scaling.angle_std + self._scaling.angle_mean

    def _encode(self, emg: Sequence[float]) -> np.ndarray:
        """Network inputs of a sample, (1, X)."""
        x = (np.asarray(emg, dtype=np.float64) - self._mean) / self._std
        if self._architecture.time_input:
            x = np.append(x, self._count * self._dt / self._scaling.duration)
        return x.astype(np.float32).astype(np.float64)[None]

    def _remember(self) -> np.ndarray:
        """W_h h_(n-1), (S, 1, G); where the state is not carried, after going through the history again."""
        if not self._carried:
            self._hidden = self._start
            for seen in self._past:
                self._hidden = self._cell(seen, self._hidden @ self._weights["hidden"])
        return self._hidden @ self._weights["hidden"]

    def _cell(self, driven: np.ndarray, recurrent: np.ndarray) -> np.ndarray:
        """As `network.apply_cell`."""
        if self._architecture.cell == "rnn":
            return np.tanh(recurrent + driven)
        h = self._architecture.hidden
        gates = 0.5 + 0.5 * np.tanh(0.5 * (recurrent[..., : 2 * h] + driven[..., : 2 * h]))
        candidate = np.tanh(driven[..., 2 * h :] + gates[..., :h] * recurrent[..., 2 * h :])
        return candidate + gates[..., h:] * (self._hidden - candidate) + self._weights["state_bias"]

    def _move(self, output: np.ndarray) -> None:
        """As `prediction.step_angle`."""
        if self._architecture.increments:
            self._v = self._v + self._units.bend * output
            self._z = self._z + self._units.step * self._v
        else:
            self._z, self._v = output, (output - self._z) / self._units.step


def start_angles(checkpoint: Checkpoint, start_deg: Sequence[float]) -> list[float]:
    """The known angles [rad] that a prediction starts from.

    Args:
        start_deg: the first angles [deg]; one alone is where the arm rests; none is the mean of the training trials.

    Raises:
        ValueError: for neither one angle nor as many as the network's history.
    """
    history = checkpoint.recipe["history_steps"]
    # ASSUME: the arm is at rest at the mean angle of the training trials, where nothing is said of its start.
    angles = [math.radians(angle) for angle in start_deg] or [checkpoint.scaling.angle_mean]
    if len(angles) not in (1, history):
        raise ValueError(
            f"the start has {len(angles)} angles; give one, where the arm rests, or the first {history} measured ones."
        )
    return angles * history if len(angles) == 1 else angles


def predict_lines(checkpoint: Checkpoint, predictor: Predictor, lines: Iterable[str], source: str) -> Iterator[str]:
    """A line of prediction for each line of EMG, as soon as it is there.

    Args:
        lines: CSV, the first line naming the columns: the network's channels, and `time_s` where it is known. Others,
            such as a measured angle, are not read.
        source: what the lines come from, for messages.

    Yields:
        CSV: time_s, angle_rad, and spread_rad over the seeds (1 SD) where they are several.

    Raises:
        ValueError: naming the line, at the first that is no sample of EMG.
    """
    rows = csv.reader(lines)
    header = [name.strip().removeprefix("\ufeff") for name in next(rows, [])]
    if missing := [name for name in checkpoint.channels if name not in header]:
        raise ValueError(
            f"{source}, line 1: no column {', '.join(missing)}; found {', '.join(header) or 'nothing'}. The first line "
            f"names the columns, among them the channels of the network: {', '.join(checkpoint.channels)}."
        )
    wanted = [name for name in ("time_s", *checkpoint.channels) if name in header]
    places = [header.index(name) for name in wanted]
    timed, before, several = "time_s" in header, None, False
    for row in rows:
        if not row:
            continue
        where = f"{source}, line {rows.line_num}"
        values = _read_numbers(row, header, places, where)
        if timed:
            time, *values = values
            _check_rate(before, time, checkpoint.dt, where)
        else:
            time = 0.0 if before is None else before + checkpoint.dt
        angle = predictor.step(values, where)
        if before is None:
            several = len(angle) > 1
            yield "time_s,angle_rad,spread_rad" if several else "time_s,angle_rad"
        before = time
        yield f"{time:.9g},{angle.mean():.9g}" + (f",{angle.std():.3g}" if several else "")


def _read_numbers(row: Sequence[str], header: Sequence[str], places: Sequence[int], where: str) -> list[float]:
    if len(row) != len(header):
        raise ValueError(f"{where}: {len(row)} values, but the first line names {len(header)} columns.")
    numbers = []
    for place in places:
        try:
            number = float(row[place])
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise ValueError(
                f"{where}: {header[place]} is {row[place]!r}, expected a number. What was predicted before is written; "
                "correct the line, or leave it and those before it out."
            )
        numbers.append(number)
    return numbers


def _check_emg(channels: Sequence[str], emg: Sequence[float], where: str) -> None:
    for name, value in zip(channels, emg, strict=True):
        if not 0 <= value <= EMG_LIMIT:
            raise ValueError(
                f"{where}: {name} is {value:g}, expected 0 to {EMG_LIMIT:g}. Rectify and smooth the EMG, and divide it "
                "by its value at maximum voluntary contraction, as was done for the training."
            )


def _check_rate(before: float | None, time: float, dt: float, where: str) -> None:
    if before is not None and abs(time - before - dt) > RATE_TOLERANCE * dt + 1e-6:
        raise ValueError(
            f"{where}: time_s goes from {before:g} to {time:g}, but the network was trained on samples {dt:g} s apart. "
            "Resample the EMG to that interval."
        )
