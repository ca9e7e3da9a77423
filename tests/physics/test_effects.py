"""Every effect of the catalogue: absent at 0, felt at its typical strength, and its signature checked."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from myowave.physics import effects
from myowave.physics.curves import DEGROOTE, MILLARD, THELEN
from myowave.physics.effect import Effect, Parameter
from myowave.physics.effect_files import check_effect
from myowave.physics.effects import SHIPPED, catalogue
from myowave.physics.model import parse_model
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation
from myowave.workflow.digest import imported_modules

FILES = set(Path(effects.__file__).parent.glob("[!_]*.py"))
NAMES = [effect.name for effect in SHIPPED]
PARAMETER = {"c": Parameter(unit="-", low=0.0, high=1.0, typical=0.5, meaning="strength")}


@pytest.fixture(scope="module")
def drive(noisy_emg):
    return noisy_emg[0.15][:2, :40]


@pytest.fixture(scope="module")
def plain(elbow, drive, dt):
    return simulate(Simulation(elbow, {}, drive, dt), 1.0)


def test_names_are_unique_and_form_model_coordinates(elbow):
    assert len(set(NAMES)) == len(NAMES)
    name = "base+" + "+".join(NAMES)
    assert parse_model(name, elbow, catalogue()).name == name


def test_every_effect_has_a_title_in_few_plain_words():
    for effect in SHIPPED:
        assert 1 < len(effect.title.split()) <= 8 and "_" not in effect.title, effect.name
    assert len({effect.title for effect in SHIPPED}) == len(SHIPPED), "one effect is told from the next by it alone"


@pytest.mark.parametrize("name", NAMES)
def test_effect_passes_the_check_that_users_effects_pass(name):
    check_effect(catalogue()[name])


@pytest.mark.parametrize("name", NAMES)
def test_effect_is_absent_at_zero_and_felt_at_its_typical_strength(name, elbow, drive, plain, dt):
    effect = catalogue()[name]
    model = elbow.with_effects([effect])
    parameters = model.parameters_of(effect)
    absent = simulate(Simulation(model, dict.fromkeys(parameters, 0.0), drive, dt), 1.0)
    torch.testing.assert_close(absent.angle, plain.angle, rtol=0, atol=1e-9)
    typical = {parameter: values.typical for parameter, values in parameters.items()}
    for parameter, values in parameters.items():
        others = dict.fromkeys(parameters, 0.0) if values.alone else typical
        felt, without = (
            simulate(Simulation(model, others | {parameter: value}, drive, dt), 1.0) for value in (values.typical, 0.0)
        )
        assert torch.isfinite(felt.angle).all()
        assert (felt.angle - without.angle).abs().max() > 1e-4, parameter


def test_all_effects_together_change_nothing_at_zero(elbow, drive, plain, dt):
    motion = simulate(Simulation(elbow.with_effects(SHIPPED), {}, drive[:, :20], dt), 1.0)
    torch.testing.assert_close(motion.angle, plain.angle[:, :20], rtol=0, atol=1e-9)


def test_curve_effects_at_full_strength_are_the_other_curves(elbow, drive, dt):
    for name, curves in (
        ("millard_curves", MILLARD), ("degroote_curves", DEGROOTE), ("thelen_curves", THELEN)
    ):  # fmt: skip
        blended = simulate(Simulation(elbow.with_effects([catalogue()[name]]), {f"{name}.w": 1.0}, drive, dt), 1.0)
        other = simulate(Simulation(replace(elbow, curves=curves), {}, drive, dt), 1.0)
        torch.testing.assert_close(blended.q, other.q, rtol=0, atol=1e-9)


def test_a_clock_shift_by_whole_samples_moves_the_record(elbow, drive, plain, dt):
    model = elbow.with_effects([catalogue()["clock_shift"]])
    late = simulate(Simulation(model, {"clock_shift.d": 3 * dt}, drive, dt), 1.0)
    torch.testing.assert_close(late.angle[..., 3:], plain.angle[..., :-3], rtol=0, atol=1e-12)


def test_a_clock_that_drifts_by_a_sample_in_ten_reads_every_tenth_sample_one_earlier(elbow, drive, plain, dt):
    model = elbow.with_effects([catalogue()["clock_drift"]])
    late = simulate(Simulation(model, {"clock_drift.d": 0.1}, drive, dt), 1.0)
    known = range(0, plain.angle.shape[-1], 10)
    torch.testing.assert_close(
        late.angle[..., known], plain.angle[..., [n - n // 10 for n in known]], rtol=0, atol=1e-9
    )


def test_crosstalk_is_taken_out_of_a_recording_to_first_order(elbow):
    recorded = torch.tensor([[0.5, 0.2]], dtype=torch.float64)
    pure = catalogue()["emg_crosstalk"].function
    side = torch.tensor([1.0, -1.0], dtype=torch.float64)
    for x in (0.1, 0.05):
        mixed = recorded + x * recorded.flip(-1)
        assert (pure(mixed, side, x=torch.tensor([x], dtype=torch.float64)) - recorded).abs().max() <= x**2


def test_co_contraction_drives_each_muscle_with_a_share_of_its_antagonists():
    excitation = torch.tensor([[0.5, 0.2, 0.4]], dtype=torch.float64)
    side = torch.tensor([1.0, -1.0, 1.0], dtype=torch.float64)
    driven = catalogue()["co_contraction"].function(excitation, side, c=torch.tensor([0.5], dtype=torch.float64))
    torch.testing.assert_close(driven, torch.tensor([[0.6, 0.425, 0.5]], dtype=torch.float64))


def test_more_strength_of_an_effect_at_once_is_a_batch(elbow, drive, dt):
    model = elbow.with_effects([catalogue()["joint_damping"], catalogue()["fatigue"]])
    strengths = torch.tensor([[0.0], [0.5], [1.0]], dtype=torch.float64)
    batch = simulate(Simulation(model, {"joint_damping.c": strengths, "fatigue.k": strengths / 2}, drive, dt), 1.0)
    for row, c in zip(batch.angle, strengths.flatten().tolist(), strict=True):
        one = simulate(Simulation(model, {"joint_damping.c": c, "fatigue.k": c / 2}, drive, dt), 1.0)
        torch.testing.assert_close(row, one.angle, rtol=0, atol=1e-12)


def effect(function, acts_on="joint", **changes):
    fields = {"name": "mine", "acts_on": acts_on, "equation": "-", "function": function, "parameters": PARAMETER}
    return Effect(**{**fields, "source": "test", **changes})


def stateful(**changes):
    def relaxation(activation):
        return activation, activation, activation

    return effect(lambda state, *, c: c * state, **{"acts_on": "activation", "relaxation": relaxation, **changes})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: effect(lambda q, *, k: -k * q), "declares \\['c'\\]"),
        (lambda: effect(lambda q, c: -c * q), "asks for \\['c'\\].*after a bare"),
        (lambda: effect(lambda hill, *, c: c, "joint"), "asks for \\['hill'\\]"),
        (lambda: effect(lambda state, *, c: c * state, "activation"), "asks for \\['state'\\]"),
        (lambda: effect(lambda *, c: c, "elbow"), "acts_on is 'elbow'"),
        (lambda: effect(lambda *, c: c, relaxation=lambda: 0), "may have a relaxation"),
        (lambda: stateful(initial=lambda l1, nonsense: l1), "initial.*asks for .*'nonsense'"),
        (lambda: stateful(initial=lambda state, *, k: state), "initial.*takes the parameters \\['k'\\]"),
        (lambda: effect(lambda *, c: c, name="my effect"), "Python identifier"),
        (lambda: effect(lambda: 0.0, parameters={}), "declares no parameters"),
        (lambda: effect(lambda f0, mass, *, c: {}, "constants"), "write two effects"),
        (lambda: Parameter(unit="-", low=0.5, high=1.0, typical=0.7, meaning="no zero"), "must hold 0"),
        (lambda: Parameter(unit="-", low=0.0, high=1.0, typical=0.0, meaning="nothing"), "and not 0"),
    ],
)
def test_a_wrong_definition_is_an_error_at_once(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_what_only_the_initial_state_asks_for_counts():
    """Else it would be let onto an arm that has no such constant."""
    assert "l1" in stateful(acts_on="muscle", initial=lambda l1: 0 * l1).constants


def test_an_effect_replaces_what_is_there_only_if_it_says_so():
    whole = {"w": Parameter(unit="-", high=1.0, typical=1.0, meaning="share")}
    assert not effect(lambda q, *, w: w * q, parameters=whole).replaces
    assert {e.name for e in SHIPPED if e.replaces} == {"millard_curves", "degroote_curves", "thelen_curves"}


def test_every_file_of_an_effect_is_in_the_catalogue_by_its_own_name():
    """The settings know the names of effects from the names of files, without loading them."""
    assert {path.stem for path in FILES} == {effect.name for effect in SHIPPED}


def test_a_rule_that_uses_the_catalogue_reruns_when_any_effect_changes():
    used = imported_modules(Path(effects.__file__).parents[2] / "models.py")
    assert used >= FILES
