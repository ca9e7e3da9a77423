"""Other curves are fitted from where constants are expected: a fit without them has gone where it imitates them."""

from myowave.diagnosis.search.score import score_effects
from myowave.diagnosis.search.weigh import fresh_starts
from myowave.identification.free_parameters import free_parameters
from myowave.identification.output_error import fit_model, polish
from myowave.identification.record import make_record
from myowave.settings import read_settings


def test_other_curves_are_found_from_fresh_constants_where_no_small_step_leads_to_them(
    make_trials, base, effects, identify, pytestconfig
):
    scatter = read_settings([pytestconfig.rootpath / "config.yaml"]).diagnosis.scatter
    record = make_record(make_trials({"degroote_curves": {"w": 1.0}}, noise_deg=0.3), base).train
    fit = fit_model(base, record, free_parameters(base, identify, record.known, scatter), starts=2)
    scores = score_effects(fit, [effects["degroote_curves"], effects["joint_damping"]])
    fresh = fresh_starts(fit, scores)
    assert set(fresh) == {"degroote_curves"}, "damping replaces nothing"
    here, afresh = (polish(begin).objective for begin in (scores["degroote_curves"].start, fresh["degroote_curves"]))
    assert afresh < 0.9 * here
    with_curves = polish(fresh["degroote_curves"])
    assert not fresh_starts(with_curves, score_effects(with_curves, [effects["millard_curves"]])), "one family"
