"""Checkpoints that are wrong, and streams of EMG for one that is right."""

import os
import zipfile
from functools import cache
from pathlib import Path

import torch

from myowave.learning.band import Band, Seen
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.network import Architecture, Scaling, initialise
from myowave.learning.streaming.command import predict_lines, start_angles
from myowave.learning.streaming.predictor import Predictor

DT = 0.02


@cache
def good() -> Checkpoint:
    """A network of two seeds that nobody trained."""
    architecture = Architecture("rollout", 6, 2, 3, delays=(0.08, 0.08))
    scaling = Scaling((0.4, 0.3), (0.2, 0.2), 0.9, 0.3, 0.02, 0.002, 5.0)
    two = torch.tensor([[300.0, 0.6], [310.0, 0.61]])
    return Checkpoint(
        dataset="case1", dataset_digest="d", model="base", model_digest="m", recipe={"method": "rollout"}, level=0,
        scales=1, seeds=(0, 1), epochs=4, seconds=1.0, dt=DT, channels=("emg_biceps", "emg_triceps"),
        architecture=architecture, scaling=scaling, weights=initialise(architecture, (0, 1)), names=("f0_Bi", "l0_Bi"),
        values=two, errors=0.01 * two, correlations=torch.eye(2).expand(2, 2, 2), physics_mse=torch.ones(2),
        val_r2=torch.zeros(2), band=Band(2.0, 0.1), seen=Seen((0.0,) * 4, (1.0,) * 4),
        real_time={},
    )  # fmt: skip


def of_checkpoint(folder: Path, spoil) -> str:
    """What loading a checkpoint is answered by; `spoil` changes its content, or the file."""
    path = folder / "scale-0.pt"
    good().save(path)
    content = torch.load(path, weights_only=True)
    if (other := spoil(path, content)) is None:
        torch.save(content, path)
    elif isinstance(other, bytes):
        path.write_bytes(other)
    Checkpoint.load(path)
    return ""


def put(**fields):
    """Other values of fields."""
    return lambda _, content: content.update(fields)


def inside(part: str, **fields):
    """Other values of fields of a part, such as its architecture."""
    return lambda _, content: content[part].update(fields)


def weight(name: str, change):
    return lambda _, content: content["weights"].update({name: change(content["weights"][name])})


def first(value: float):
    def change(weights):
        weights = weights.clone()
        weights.flatten()[0] = value
        return weights

    return change


def flipped(place: float):
    def spoil(path, _):
        held = bytearray(path.read_bytes())
        held[int(place * len(held))] ^= 0xFF
        return bytes(held)

    return spoil


def flipped_weight(path, content):
    held = bytearray(path.read_bytes())
    held[held.index(content["weights"]["output"].numpy().tobytes())] ^= 0xFF
    return bytes(held)


def other_archive(path, _):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("hello.txt", "hello")
    return True


def pipe(path, _):
    path.unlink()
    os.mkfifo(path)
    return True


LOADED = {"known": {"load": 0.0}, "told": ("load",)}
UNFIT = "this checkpoint cannot be used: its weights, channels, seeds"


def field(place: str, says: str) -> str:
    return f"this checkpoint cannot be used, or is of another version of myowave: {place}: .*{says}"


CHECKPOINTS = {
    "empty": (lambda *_: b"", "not a checkpoint"),
    "text": (lambda *_: b"hello", "not a checkpoint"),
    "cut in half": (lambda path, _: path.read_bytes()[: path.stat().st_size // 2], "not a checkpoint"),
    "cut at its end": (lambda path, _: path.read_bytes()[:-20], "not a checkpoint"),
    "a byte of a weight": (flipped_weight, "damaged"),
    "a byte of the head": (flipped(0.02), "damaged|not a checkpoint"),
    "another archive": (other_archive, "not a checkpoint"),
    "a pipe": (pipe, "this is a pipe or a device"),
    "another object": (lambda path, _: torch.save([1, 2], path) or True, "checkpoint format is None"),
    "code in it": (lambda path, _: torch.save(print, path) or True, "not a checkpoint"),
    "another version": (put(format=99), "checkpoint format is 99, expected"),
    "a field missing": (lambda _, c: c.pop("dt") and None, field("dt", "required")),
    "a field more": (put(mood="good"), field("mood", "nexpected")),
    "a recipe that is none": (put(recipe="{"), field("recipe", "JSON")),
    "an architecture that is none": (put(architecture="gru"), field("architecture", "dictionary")),
    "another field of the architecture": (inside("architecture", layers=2), field("architecture.layers", "nexpected")),
    "no band where there is one": (put(band={"width": 3}), field("band.factor", "required")),
    "no weights": (put(weights={}), UNFIT),
    "weights missing": (lambda _, c: c["weights"].clear(), UNFIT),
    "a weight more": (lambda _, c: c["weights"].update(gate=torch.ones(2)), UNFIT),
    "a weight of another shape": (weight("hidden", lambda w: w[:, :3]), UNFIT),
    "weights of one seed": (weight("hidden", lambda w: w[:1]), UNFIT),
    "a weight that is NaN": (weight("hidden", first(float("nan"))), UNFIT),
    "an infinite weight": (weight("output", first(float("inf"))), UNFIT),
    "an unknown cell": (inside("architecture", method="lstm"), UNFIT),
    "too few delays": (inside("architecture", delays=[0.08]), UNFIT),
    "too many delays": (inside("architecture", delays=[0.08] * 3), UNFIT),
    "a negative delay": (inside("architecture", delays=[-0.08, 0.08]), field("architecture.delays.0", "greater")),
    "a delay that is NaN": (inside("architecture", delays=[float("nan"), 0.08]), field("architecture.delays.0", "")),
    "no history": (inside("architecture", history=0), field("architecture.history", "greater")),
    "more hidden units": (inside("architecture", hidden=7), UNFIT),
    "an input more": (inside("architecture", given=LOADED), UNFIT),
    "a seed more": (put(seeds=(0, 1, 2)), UNFIT),
    "a seed twice": (put(seeds=(0, 0)), UNFIT),
    "no seeds": (put(seeds=()), UNFIT),
    "another arm's channels": (put(channels=("emg_a",)), UNFIT),
    "a channel twice": (put(channels=("emg_a", "emg_a")), UNFIT),
    "a scaling of nothing": (inside("scaling", angle_std=0.0), field("scaling.angle_std", "greater")),
    "a scaling that is NaN": (inside("scaling", angle_mean=float("nan")), field("scaling.angle_mean", "finite")),
    "a scaling of one input": (inside("scaling", input_mean=(0.4,)), UNFIT),
    "a negative scaling": (inside("scaling", input_std=(0.2, -0.2)), field("scaling.input_std.1", "greater")),
    "no time between samples": (put(dt=0.0), field("dt", "greater")),
    "a time that is NaN": (put(dt=float("nan")), field("dt", "finite")),
    "a scale of none": (put(level=3), UNFIT),
    "a parameter more": (put(names=("f0_Bi",)), UNFIT),
    "a parameter that is NaN": (put(values=torch.full((2, 2), float("nan"))), UNFIT),
    "errors of another shape": (put(errors=torch.ones(1)), UNFIT),
    "a band of no width": (inside("band", factor=0.0), field("band.factor", "greater")),
    "a band that is NaN": (inside("band", floor=float("nan")), field("band.floor", "greater")),
    "ranges of another network": (inside("seen", low=(0.0,)), UNFIT),
    "ranges the wrong way round": (inside("seen", low=(2.0,) * 4), UNFIT),
    "ranges that are NaN": (inside("seen", high=(float("nan"),) * 4), UNFIT),
    "a history without end": (inside("architecture", history=10**9), field("architecture.history", "less")),
    "years between samples": (put(dt=1e9), field("dt", "less")),
    "a scaling next to nothing": (inside("scaling", input_std=(1e-300, 0.2)), field("scaling.input_std.0", "greater")),
    "channels that are numbers": (put(channels=(1, 2)), field("channels.0", "string")),
    "a parameter twice": (put(names=("f0_Bi", "f0_Bi")), UNFIT),
    "weights of whole numbers": (weight("output", lambda w: w.long()), UNFIT),
    "complex weights": (weight("output", lambda w: w.to(torch.complex64)), UNFIT),
    "weights with holes": (weight("output", lambda w: w.to_sparse()), UNFIT),
}  # fmt: skip

# ------------------------------------------------------------------------------------------------------ streams


def table(rows: int = 12) -> list[str]:
    head = "time_s,emg_biceps,emg_triceps"
    return [head, *(f"{DT * n:.2f},{0.3 + 0.01 * n:.3f},{0.5 - 0.01 * n:.3f}" for n in range(rows))]


def of_stream(spoil, start=(30.0,), seeds=None, fixed=None) -> str:
    """What a stream with a fault is answered by, after the answers that came before it."""
    lines = table()
    spoil(lines)
    network = good()
    whole, angles = [f"{line}\n" for line in lines], start_angles(network, ",".join(map(str, start)))
    for _ in predict_lines(Predictor(network, seeds), whole, "the sensor", angles, fixed or {}, say=str):
        pass
    return ""


def line(number: int, change):
    """Another text of a line, counted from 1."""

    def spoil(lines):
        lines[number - 1] = change(lines[number - 1]) if callable(change) else change

    return spoil


def cell(number: int, column: int, text: str):
    def change(old):
        cells = old.split(",")
        cells[column] = text
        return ",".join(cells)

    return line(number, change)


def every(change):
    def spoil(lines):
        lines[1:] = [change(one) for one in lines[1:]]

    return spoil


def every_end(head: str, others: str):
    def spoil(lines):
        lines[:] = [one + (others if i else head) for i, one in enumerate(lines)]

    return spoil


def first_cell(factor):
    return lambda one: f"{factor * float(one.split(',')[0]):g},{one.partition(',')[2]}"


STREAMS = {
    "no such channel": (cell(1, 2, "triceps"), "line 1.*emg_triceps"),
    "no header": (lambda lines: lines.pop(0), "line 1.*no column emg_biceps"),
    "a channel twice": (line(1, "time_s,emg_biceps,emg_biceps,emg_triceps"), "line 1.*emg_biceps.*keep one"),
    "an angle twice": (every_end(",angle_deg,angle_deg", ",1,2"), "line 1.*angle_deg.*keep one"),
    "German": (line(1, "Zeit,Bizeps,Trizeps"), "line 1.*no column emg_biceps"),
    "text": (cell(8, 1, "abc"), "line 8.*'abc'"),
    "NaN": (cell(8, 1, "nan"), "line 8.*'nan'"),
    "infinite": (cell(8, 2, "inf"), "line 8.*'inf'"),
    "nothing in a cell": (cell(8, 1, ""), "line 8.*''.*expected a number"),
    "not normalised": (cell(8, 1, "5.1"), "line 8.*emg_biceps is 5.1.*expected 0 to 5"),
    "percent": (cell(2, 1, "35"), "line 2.*emg_biceps is 35.*expected 0 to 5"),
    "not rectified": (cell(8, 2, "-0.11"), "line 8.*emg_triceps is -0.11.*Rectify"),
    "another rate": (every(first_cell(0.7)), "line 3.*time_s.*Resample"),
    "time in ms": (every(first_cell(1000)), "line 3.*time_s.*Resample"),
    "time goes back": (cell(8, 0, "0.01"), "line 8.*time_s goes from"),
    "time stays": (cell(8, 0, "0.10"), "line 8.*time_s goes from"),
    "time is NaN": (cell(8, 0, "nan"), "line 8.*time_s"),
    "time is text": (cell(8, 0, "now"), "line 8.*time_s"),
    "a time is missing": (lambda lines: lines.pop(7), "line 8.*time_s goes from"),
    "a stray quote": (line(7, lambda one: '"' + one), "line 7.*no line of CSV"),
    "a quote inside": (line(7, lambda one: one.replace(",", ',"', 1)), "line 7.*no line of CSV"),
    "a cell too many": (line(7, lambda one: "0," + one), "line 7.*4 values.*names 3 columns"),
    "a line cut off": (line(7, lambda one: one[:7]), "line 7.*values, but the first line names 3"),
    "a zero byte": (line(7, lambda one: one.replace("0", "\0", 1)), "line 7"),
    "no samples": (lambda lines: lines.__delitem__(slice(1, None)), "the sensor: no samples below the names"),
    "a word at the end": (lambda lines: lines.append("end"), "line 14.*1 values, but the first line names 3"),
}  # fmt: skip
ASKED = {
    "too few angles": ({"start": (30.0, 31.0)}, "--start-deg has 2 angles; give one"),
    "too many angles": ({"start": (30.0,) * 9}, "--start-deg has 9 angles"),
    "a seed that is none": ({"seeds": [7]}, r"no seed \[7\] in the checkpoint; it has \[0, 1\]"),
}
