"""Forearm and hand from body measures: how they scale, how they agree with another table, what is refused."""

import math

import pytest

from myowave.physics.anthropometry import DE_LEVA, SEXES, forearm_with_hand


def values(*body):
    return {name: estimate.value for name, estimate in forearm_with_hand(*body).items()}


@pytest.mark.parametrize("sex", SEXES)
def test_masses_scale_with_the_body_and_lengths_with_its_height(sex):
    small, heavy, tall = values(50, 1.6, sex), values(100, 1.6, sex), values(50, 1.92, sex)
    for name, of_mass, of_height in (("mass", 1, 0), ("com", 0, 1), ("inertia", 1, 2), ("grip", 0, 1)):
        assert heavy[name] == pytest.approx(small[name] * 2**of_mass)
        assert tall[name] == pytest.approx(small[name] * 1.2**of_height)


@pytest.mark.parametrize("sex", SEXES)
def test_a_body_of_the_table_has_the_tables_own_mass_and_lengths(sex):
    table = DE_LEVA[sex]
    forearm = values(60, table.height, sex)
    assert forearm["mass"] == pytest.approx(60 * (table.forearm.mass + table.hand.mass))
    assert table.forearm.com * table.forearm.length < forearm["com"] < table.forearm.length
    assert table.forearm.length < forearm["grip"] < table.forearm.length + table.hand.length


@pytest.mark.parametrize("sex", SEXES)
def test_the_inertia_is_that_of_two_rods_swung_about_the_elbow(sex):
    """Two masses at one gyration radius on either side of each centre of mass swing as the segments do."""
    table, mass = DE_LEVA[sex], 70.0
    inertia = weight = 0.0
    for segment, start in ((table.forearm, 0.0), (table.hand, table.forearm.length)):
        for end in (-1, 1):
            at = start + (segment.com + end * segment.gyration) * segment.length
            inertia += mass * segment.mass / 2 * at**2
            weight += mass * segment.mass / 2 * at
    forearm = values(mass, table.height, sex)
    assert forearm["inertia"] == pytest.approx(inertia) and forearm["mass"] * forearm["com"] == pytest.approx(weight)


def test_another_table_is_within_two_standard_deviations():
    """Winter 2009, forearm and hand: 0.022 of the mass, centre at 0.682 and gyration 0.827 of a forearm of 0.146 H."""
    mass, height = 75.0, 1.75
    forearm = 0.146 * height
    winter = {"mass": 0.022 * mass, "com": 0.682 * forearm, "inertia": 0.022 * mass * (0.827 * forearm) ** 2}
    for name, value in winter.items():
        estimate = forearm_with_hand(mass, height, "m")[name]
        assert abs(value - estimate.value) < 2 * estimate.sd, name


def test_the_inertia_is_less_sure_than_mass_and_length_together():
    estimates = forearm_with_hand(70, 1.7, "f")
    relative = {name: e.sd / e.value for name, e in estimates.items()}
    assert relative["inertia"] > math.hypot(relative["mass"], relative["com"])
    assert all(0.02 < share < 0.2 for share in relative.values()) and all(e.source for e in estimates.values())


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ((70_000, 1.75, "f"), "body mass is 70000; expected 30 to 250 kg"),
        ((70, 175, "f"), "height is 175; expected 1.2 to 2.3 m"),
        ((70, 1.75, "female"), r"sex is 'female'; expected one of f \(woman\), m \(man\)"),
        ((math.nan, 1.75, "f"), "body mass is nan"),
    ],
)
def test_a_body_in_other_units_is_refused(body, says):
    with pytest.raises(ValueError, match=says):
        forearm_with_hand(*body)
