"""Arms and recordings that differ from what the diagnosis takes them for, each world in a way of its own, one in all.

A world says how the trials of a case are made; the diagnosis gets them and the same model in every world. Nothing here
is taken from the families that the diagnosis knows: other curves are splines through knots drawn within physiological
bounds, other constants are drawn with the scatter of the settings, other sensors filter, resample, drift and add noise,
and another solver has a sample-and-hold of the EMG.

Shapes: T trials, N samples, C channels.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from scipy.interpolate import CubicSpline, PchipInterpolator, make_interp_spline
from scipy.signal import lfilter
from torch import Tensor

from myowave.data.trials import Array, Trials
from myowave.diagnosis.causes import EMG_NOISE, GAIN_PER_TRIAL, OUTSIDE, OWN_SHAPES
from myowave.identification.free_parameters import free_parameters
from myowave.physics.curves import Curve, Curves
from myowave.physics.model import Model
from myowave.settings import Scatter
from studies.shared import low_pass

# As the model assumes, other in one way, in all of these at once, and arms of other simulators.
WORLDS = {
    "as_assumed": "as the model assumes",
    "other_curves": "other muscle curves",
    "other_constants": "other constants",
    "other_sensors": "other sensors and filters",
    "other_solver": "sample-and-hold of EMG in the solver",
    "outside": "effect not in the catalogue",
    "all_at_once": "all of these at once",
    "other_simulator": "another simulator",
    "mujoco": "moved by MuJoCo",
}
TABLE = np.linspace(0.0, 2.5, 2001)  # fibre lengths, and velocities + 1, at which a drawn curve is tabulated
FINER = 4  # steps in a sample of the solver with a sample-and-hold
# Samples by which it is later than EMG that is straight between samples: in each step it is straight, too.
HELD_BACK = (FINER - 1) / (2 * FINER)

CURVES = frozenset({"millard_curves", "degroote_curves", "thelen_curves"})  # each says that the curves are others

# What is true of a world whatever is hidden in it: names that say what is different there.
TRUE: Mapping[str, frozenset[str]] = {
    "other_curves": CURVES | {OWN_SHAPES},
    "other_constants": frozenset({"vmax_change", "extra_delay", "activation_shape", "moment_arm_offset"}),
    "other_solver": frozenset({"extra_delay"}),  # `HELD_BACK` of a sample
}
# And of a sensor.
TRUE_OF: Mapping[str, frozenset[str]] = {
    "emg_noise": frozenset({EMG_NOISE}),
    "drift_pct": frozenset({"clock_drift"}),
    "gain_pct": frozenset({GAIN_PER_TRIAL, OUTSIDE}),
}
NOISES = frozenset({"emg_noise", "ar_deg", "step_deg"})  # of a recorder, that another recording would have otherwise


@dataclass(frozen=True)
class World:
    """How the trials of one case are made."""

    model: Model  # with its own curves, and without effects
    constants: Mapping[str, float] = field(default_factory=dict)  # that differ from the model's, by name
    sample_and_hold: bool = False  # whether the EMG keeps its value between samples
    # what happens to a recording, by name: emg_noise [-], emg_hz and angle_hz (low-pass filters), step_deg (rounding),
    # rate_hz, ar_deg and ar_s (coloured noise of the angle), drift_pct (of the angle's clock), gain_pct (of the EMG of
    # the first trial)
    recording: Mapping[str, float] = field(default_factory=dict)


def draw_world(
    name: str, base: Model, scatter: Mapping[str, Scatter], random: np.random.Generator, turn: int = 0
) -> World:
    """Draw an arm, a solver or a recorder of a world; sensors take turns."""
    world = World(base)
    if name in ("other_curves", "all_at_once"):
        world = replace(world, model=replace(base, curves=draw_curves(random)))
    if name in ("other_constants", "all_at_once"):
        assumed = [p for p in free_parameters(base, {}, (), scatter) if not p.name.endswith("_curve")]
        drawn = {p.name: p.start + p.deviation * random.standard_normal() for p in assumed}
        world = replace(world, constants={p.name: float(np.clip(drawn[p.name], p.low, p.high)) for p in assumed})
    sensors = draw_sensors(random)
    if name == "other_sensors":
        world = replace(world, recording=sensors[turn % len(sensors)])
    if name == "all_at_once":
        world = replace(world, recording=MIXED[turn % len(MIXED)](random))
    return replace(world, sample_and_hold=name in ("other_solver", "all_at_once"))


def draw_sensors(random: np.random.Generator) -> list[dict[str, float]]:
    """One recorder of each kind; what it does not say is exact."""
    noise, edge = random.uniform(0.01, 0.05), random.uniform(4.0, 10.0)
    return [
        {"emg_noise": noise},
        {"angle_hz": edge},
        {"rate_hz": random.uniform(50.0, 200.0)},
        {"step_deg": random.uniform(0.25, 1.0)},
        {"ar_deg": random.uniform(0.5, 1.0), "ar_s": random.uniform(0.2, 0.5)},
        {"drift_pct": random.choice([0.3, 1.0])},
        {"gain_pct": random.choice([-5.0, -15.0])},
        {"emg_hz": random.uniform(4.0, 8.0)},
        {"emg_noise": noise, "angle_hz": edge},
    ]


def draw_curves(random: np.random.Generator) -> Curves:
    """Smooth muscle curves through knots within physiological bounds: an active one with its peak at length 1, a
    passive one that rises, a force-velocity curve through (-1, 0) and (0, 1)."""
    # ASSUME: bounds as the spread of published curves (Thelen 2003, Millard et al. 2013, De Groote et al. 2016).
    short, low = random.uniform(0.35, 0.5), random.uniform(0.7, 0.78)
    high, long = random.uniform(1.22, 1.35), random.uniform(1.55, 1.8)
    active = [(0.0, 0.0), (short, 0.0), (low, random.uniform(0.55, 0.8)), (1.0, 1.0)]
    active += [(high, random.uniform(0.6, 0.85)), (long, 0.0), (2.5, 0.0)]
    onset, stiff = random.uniform(0.95, 1.1), random.uniform(0.5, 1.6)
    passive = [(0.0, 0.0), (onset, 0.0), (1.25, 0.12 * stiff), (1.5, 0.6 * stiff), (2.5, 4.0 * stiff)]
    bend, largest = random.uniform(0.18, 0.35), random.uniform(1.3, 1.6)
    slow = [(v, (1 + v) / (1 - v / bend)) for v in (-1.0, -0.75, -0.5, -0.25, -0.1, 0.0)]
    steep = random.uniform(0.5, 1.2) * (1 + 1 / bend)
    fast = [(v, 1 + (largest - 1) * (1 - np.exp(-steep * v / (largest - 1)))) for v in (0.05, 0.15, 0.3, 0.6, 1.0)]
    speed = [(1 + v, max(f, 0.0)) for v, f in (*slow, *fast)] + [(2.5, largest)]
    return Curves(_tabulated(active, 0.0), _tabulated(passive, 0.0), _tabulated(speed, 1.0))


def _tabulated(knots: list[tuple[float, float]], shift: float) -> Curve:
    """A monotone spline through knots as a curve; `shift` is added to what it is asked for."""
    table = torch.from_numpy(PchipInterpolator(*np.array(knots).T)(TABLE))
    width = float(TABLE[1] - TABLE[0])

    def curve(x: Tensor) -> Tensor:
        position = ((x + shift) / width).clamp(0.0, len(TABLE) - 1.001)
        left = position.detach().floor().long()
        share = position - left
        return table[left] * (1 - share) + table[left + 1] * share

    return curve


def sample_and_hold(emg: Tensor) -> Tensor:
    """EMG (T, N, C) that keeps its value between samples, on a grid `FINER` times as fine."""
    fine = emg.repeat_interleave(FINER, dim=-2)
    return fine[..., : (emg.shape[-2] - 1) * FINER + 1, :]


def record(trials: Trials, world: World, noise_deg: float, random: np.random.Generator) -> Trials:
    """Trials as the recorder of a world reports them, with white noise of the angle."""
    settings, emg, angle = world.recording, trials.emg.copy(), trials.angle
    time: Array = np.arange(angle.shape[1], dtype=np.float64) * trials.dt
    if drift := settings.get("drift_pct"):
        angle = CubicSpline(time, angle, axis=1)(time * (1 - drift / 100))
    if gain := settings.get("gain_pct"):
        emg[0] *= 1 + gain / 100
    angle = angle + np.radians(noise_deg) * random.standard_normal(angle.shape)
    if coloured := settings.get("ar_deg"):
        kept = np.exp(-trials.dt / settings["ar_s"])
        white = random.standard_normal((len(angle), 200 + angle.shape[1])) * np.sqrt(1 - kept**2)
        angle = angle + np.radians(coloured) * lfilter([1.0], [1.0, -kept], white)[:, 200:]
    if noise := settings.get("emg_noise"):
        emg = emg + noise * random.standard_normal(emg.shape)
    if edge := settings.get("emg_hz"):
        emg = low_pass(emg, edge, trials.dt)
    if edge := settings.get("angle_hz"):
        angle = low_pass(angle, edge, trials.dt)
    if step := settings.get("step_deg"):
        angle = np.radians(step) * np.round(angle / np.radians(step))
    if rate := settings.get("rate_hz"):
        fine: Array = np.arange(0.0, float(time[-1]), 1 / rate)[: 2 * len(time)]
        emg, angle = (resampled(x, time, fine) for x in (emg, angle))
        lengths = (len(fine),) * len(trials.names)
        return replace(trials, dt=1 / rate, lengths=lengths, emg=np.clip(emg, 0.0, 1.0), angle=angle)
    return replace(trials, emg=np.clip(emg, 0.0, 1.0), angle=angle)


def resampled(values: Array, time: Array, fine: Array) -> Array:
    """Signals (T, N, ...) at other times: straight between samples, as the physics takes EMG to be."""
    return np.asarray(make_interp_spline(time, values, k=1, axis=1)(fine))


MIXED: tuple[Callable[[np.random.Generator], dict[str, float]], ...] = (  # recorders where all differs at once, in turn
    lambda random: {"emg_noise": random.uniform(0.01, 0.03), "angle_hz": random.uniform(4.0, 10.0)},
    lambda random: {
        "angle_hz": random.uniform(4.0, 10.0), "ar_deg": random.uniform(0.3, 0.6), "ar_s": random.uniform(0.2, 0.5)
    },
    lambda random: {"drift_pct": 0.3, "gain_pct": -5.0, "rate_hz": random.uniform(50.0, 200.0)},
)  # fmt: skip
