"""How fast is the diagnosis beside the plain way: one scipy `solve_ivp` + `least_squares` fit for each candidate?

Both fit base + joint damping to the same four trials of 500 samples. scipy integrates plain numpy equations (RK45,
tolerance 1e-6) trial after trial with derivatives by differences; it is spared the trials' starts, which it is told.
The diagnosis does all of its work on the whole catalogue: fit, scores, refits, evidence. Processor time, one thread.
"""

import math
import time

import numpy as np
import torch
import yaml
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from myowave.data.simulate import simulate_trials
from myowave.diagnosis.search.diagnose import weigh
from myowave.identification.free_parameters import free_parameters
from myowave.identification.output_error import fit_model
from myowave.identification.record import Record, make_record
from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.physics.model import Model
from myowave.settings import Physics, Scatter, SimulatedDataset

DAMPING = 0.6  # N m s/rad, hidden
NOISE_DEG = 0.5


def main() -> None:
    torch.set_num_threads(1)
    threadpool_limits(1)  # of numpy, too: processor time counts all threads
    with open("config.yaml", encoding="utf-8") as file:
        config = yaml.safe_load(file)
    base = build_model("base", Physics.model_validate(config["physics"]["arms"]["paper"]))
    scatter = {name: Scatter.model_validate(of) for name, of in config["diagnosis"]["scatter"].items()}
    hidden = {"joint_damping": {"c": DAMPING}}
    settings = SimulatedDataset(kind="simulated", test=("3",), hidden_effect=hidden, angle_noise_deg=NOISE_DEG)
    effects = catalogue()
    record = make_record(simulate_trials("benchmark", settings, base, effects)[0], base).train

    begin = time.process_time()
    fit = fit_model(base, record, free_parameters(base, settings.identify, (), scatter), starts=8)
    ladder = weigh(fit, record, fit.free, list(effects.values())).ladder
    ours = time.process_time() - begin

    begin = time.process_time()
    plain = fit_with_scipy(base, record, settings.start_rad)
    theirs = time.process_time() - begin

    print(f"diagnosis, {len(effects)} candidates: {ours:.1f} s, {ours / len(effects):.2f} s each: {ladder.effects}")
    print(f"   joint_damping.c = {ladder.fit.parameters.get('joint_damping.c', math.nan):.3f}, true {DAMPING}")
    print(f"scipy, one candidate: {theirs:.1f} s, joint_damping.c = {plain.x[-1]:.3f}, {plain.nfev} evaluations")
    print(f"for the catalogue the diagnosis is {theirs * len(effects) / ours:.0f} times faster")


def fit_with_scipy(base: Model, record: Record, start_rad: float):
    """least_squares on f0 and l0 of both muscles and the damping, by simulations with solve_ivp."""
    flexor, extensor = (m.nominal for m in base.muscles)
    time_s = np.arange(record.angle.shape[1]) * record.dt
    emg = np.maximum(record.emg.numpy(), 0.0)
    weight = base.joint["mass"] * 9.80665 * base.joint["length"]
    inertia = base.joint["mass"] * base.joint["length"] ** 2

    def simulate(values: np.ndarray, trial: int) -> np.ndarray:
        muscles = ({**flexor, "f0": values[0], "l0": values[1]}, {**extensor, "f0": values[2], "l0": values[3]})

        def slope(t: float, state: np.ndarray) -> list[float]:
            q, qdot = state
            total = -weight * math.sin(q) - values[4] * qdot
            for channel, (muscle, side) in enumerate(zip(muscles, (1.0, -1.0), strict=True)):
                u = np.interp(t - muscle["delay"], time_s, emg[trial, :, channel])
                a = math.expm1(muscle["shape"] * u) / math.expm1(muscle["shape"])
                total += muscle_torque(q, qdot, a, muscle, side)
            return [qdot, total / inertia]

        span = (0.0, time_s[-1])
        return solve_ivp(slope, span, [start_rad, 0.0], t_eval=time_s, rtol=1e-6, atol=1e-6).y[0]

    def residual(values: np.ndarray) -> np.ndarray:
        return np.concatenate([simulate(values, i) - record.angle[i] for i in range(len(record.names))])

    start = [flexor["f0"], flexor["l0"], extensor["f0"], extensor["l0"], 0.1]
    return least_squares(residual, start, x_scale=[300.0, 0.6, 300.0, 0.4, 1.0], diff_step=1e-2, xtol=1e-4, ftol=1e-4)


def muscle_torque(q: float, qdot: float, a: float, muscle: dict, side: float) -> float:
    """Eqs. 45-50 and 57-59 for one muscle, in plain Python."""
    path = math.sqrt(muscle["l1"] ** 2 + muscle["l2"] ** 2 + side * 2 * muscle["l1"] * muscle["l2"] * math.cos(q))
    arm = side * muscle["l1"] * muscle["l2"] * math.sin(q) / path
    length, v = (path - muscle["slack"]) / muscle["l0"], -arm * qdot / muscle["vmax"]
    if abs(length - 1) <= 0.4:
        active = 1 - 4 * (1 - length) ** 2
    else:
        active = 9 * (abs(length - 1) - 0.6) ** 2 if abs(length - 1) < 0.6 else 0.0
    toe = math.expm1(6.6 * (min(max(length, 1.0), 1.4) - 1))
    passive = 0.075 * (toe + 6.6 * math.exp(6.6 * 0.4) * max(length - 1.4, 0.0))
    speed = max(1 + v, 0.0) / (1 - v / 0.25) if v <= 0 else (1 + 1.4 * 12.5 * v) / (1 + 12.5 * v)
    return muscle["f0"] * (a * active * speed + passive) * arm


if __name__ == "__main__":
    main()
