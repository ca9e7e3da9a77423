"""What tests of several layers share: one thread, a small elbow to fit and to diagnose, and a verdict."""

from collections.abc import Callable
from typing import Any

import pytest
import torch
import yaml

from myowave.diagnosis.comparison.baselines import EMG_ONLY, HOLD, POSTURE
from myowave.identification.free_parameters import Free, free_parameters
from myowave.models import build_model
from myowave.physics.effect import Effect
from myowave.physics.effects import catalogue
from myowave.physics.model import Model
from myowave.settings import Identify, Physics, SimulatedDataset


@pytest.fixture(scope="session", autouse=True)
def _one_thread():
    torch.set_num_threads(1)


@pytest.fixture(scope="session")
def base(pytestconfig) -> Model:
    config = yaml.safe_load((pytestconfig.rootpath / "config.yaml").read_text(encoding="utf-8"))
    return build_model("base", Physics.model_validate(config["physics"]["arms"]["paper"]))


@pytest.fixture(scope="session")
def effects() -> dict[str, Effect]:
    return catalogue()


@pytest.fixture(scope="session")
def dataset() -> SimulatedDataset:
    return SimulatedDataset(kind="simulated", trials=4, samples=200, test=("4",), seed=3)


@pytest.fixture(scope="session")
def identify(dataset) -> dict[str, Identify]:
    return dict(dataset.identify)


@pytest.fixture(scope="session")
def free(base, identify) -> tuple[Free, ...]:
    return free_parameters(base, identify, ())


@pytest.fixture(scope="session")
def facts() -> Callable[..., dict[str, Any]]:
    """verdict.json of a base model that misses damping, but for what is changed."""

    def parameter(value: float, **more: object) -> dict[str, Any]:
        about = {"se": 1.0, "assumed": False, "unit": "N", "low": 0.0, "high": 1000.0, "true": None, "error_pct": None}
        about |= {"meaning": "a constant", "at_bound": False}
        return {"value": value, **about, **more}

    c = parameter(1.5, se=0.1, unit="N m s/rad")
    verdict: dict[str, Any] = {
        "dataset": "elbow",
        "electrodes": ["emg_biceps", "emg_triceps"],
        "horizon_s": None,
        "verdict": "effect",
        "effects": ["joint_damping"],
        "model": "base+joint_damping",
        "alternatives": [],
        "where": [],
        "worst_part_deg": 4.0,
        "rmse_deg": {
            "base": {"train": 3.3, "heldout": 6.4, "fitted": 3.3, "noise": 0.5},
            "base+joint_damping": {"train": 0.5, "heldout": 1.7, "fitted": 0.5, "noise": 0.5},
        },
        "parameters": {
            "base": {"f0": parameter(200.0, se=5.0)},
            "base+joint_damping": {"f0": parameter(300.0, se=2.0), "joint_damping.c": c},
        },
        "missing_torque_Nm": {"base": 0.5, "base+joint_damping": 0.0},
        "torque_noise_Nm": {"base": 0.04, "base+joint_damping": 0.04},
        "next_trial": None,
        "absorbed": {},
        "outside_usual_range": {},
        "explained": 1.0,
        "rest": "",
        "models_that_leave_more": ["base"],
        "follows": True,
        "missing_deg": 0.0,
        "emg_noise": 0.0,
        "probabilities": {"joint_damping": 0.97, "outside": 0.02},
        "emg_motion_deg": 0.0,
        "evidence": {"joint_damping": {"without": "base", "log_odds": 80.0}},
        "scored": 29,
        "nearest": [],
        "formula": "0",
        "failed": {},
        "noise_is_bound": False,
        "titles": {"joint_damping": "damping of the joint", "emg_noise": "noise of the recorded EMG"},
        "hidden": None,
        "hit": None,
        "command": "snakemake --cores 2 this --configfile mine.yaml",
        "torque": {"held_out": True, "r2": {"base": 0.8, "base+joint_damping": 0.9, POSTURE: 0.3, EMG_ONLY: 0.2}},
        "horizons": {
            "held_out": True,
            "horizon_s": 0.5,
            "rmse_deg": {"base": 3.0, "base+joint_damping": 1.25, HOLD: 9.0},
            "whole_deg": {"base": 6.4, "base+joint_damping": 1.7},
        },
    }
    return lambda **changes: {**verdict, **changes}
