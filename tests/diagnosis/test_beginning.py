"""A trial is cut out of a motion that had begun before: the EMG that nobody recorded is no noise and no effect."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.data.trials import Trials
from myowave.diagnosis.likelihood.beginning import by_emg_before
from myowave.diagnosis.search.diagnose import weigh
from myowave.identification.free_parameters import effect_parameters
from myowave.identification.output_error import Fit, fit_from, fit_model, refit
from myowave.identification.record import make_record
from myowave.physics.motion import simulate

CUT = 60  # samples


@pytest.fixture(scope="module")
def cut_out(make_trials):
    """Trials that others begin with, from a later sample on."""

    def make(**about) -> Trials:
        whole = make_trials(**about)
        lengths = tuple(n - CUT for n in whole.lengths)
        return replace(whole, emg=whole.emg[:, CUT:], angle=whole.angle[:, CUT:], lengths=lengths)

    return make


@pytest.fixture(scope="module", params=[False, True], ids=["at once", "with a lag"])
def fit(request, make_fit, base, effects) -> Fit:
    if not request.param:
        return make_fit()
    model, made = base.with_effects([effects["activation_dynamics"]]), make_fit({"activation_dynamics": {"decay": 0.1}})
    return refit(made, model, (*made.free, *effect_parameters(model, effects["activation_dynamics"])))


def test_any_past_of_a_trial_moves_it_as_the_ways_of_the_emg_say(fit):
    """Against simulations of trials that begin after other EMG, as it was before some sample of the same recording."""
    columns, lead, emg = by_emg_before(fit), 30, fit.record.emg
    start, random = torch.from_numpy(fit.starts), np.random.default_rng(0)

    def angle(past: torch.Tensor) -> np.ndarray:
        simulation = replace(fit.simulation, emg=torch.cat([past, emg], 1), lead=lead)
        return simulate(simulation, start[:, 0], start[:, 1]).angle.numpy()

    held = emg[:, :1].expand(-1, lead, -1)
    left, moved = 0.0, 0.0
    for sample in random.integers(lead, int(fit.record.lengths.min()), 12):
        past = held + 0.05 * (emg[:, sample - lead : sample] - emg[:, sample : sample + 1])
        change = angle(past) - angle(held)
        for trial, own in zip(change, columns, strict=True):
            best = own @ np.linalg.lstsq(own, trial, rcond=1e-9)[0]
            left, moved = left + ((trial - best) ** 2).sum(), moved + (trial**2).sum()
    assert moved > 0 and left < 0.02 * moved


def test_emg_before_a_piece_is_known_but_for_the_first_of_a_trial(fit):
    record = fit.record.cut(0.5)
    begin = record.begin_s
    first = np.isclose(begin, 0)
    assert first.any() and not first.all()
    pieces = fit_from(fit.model, record, fit.free, fit.values[None])
    strong = np.abs(by_emg_before(pieces)).max((1, 2))
    assert (strong[first] > 0).all() and (strong[begin > 0.3] == 0).all()


def test_a_trial_cut_out_of_a_motion_lacks_nothing(cut_out, base, effects, free):
    record = make_record(cut_out(noise_deg=0.02), base, noise_deg=0.02).train
    candidates = [effects[name] for name in ("joint_damping", "extra_delay", "activation_dynamics", "emg_offset")]
    found = weigh(fit_model(base, record, free, starts=2), record, free, candidates)
    assert found.kind == "adequate" and not found.causes
