"""A name that is not true is wrong wherever it stands, silence about what shows is a miss, and a class is no answer."""

import pytest

from myowave.diagnosis.causes import EMG_NOISE, OUTSIDE
from myowave.diagnosis.scoring import add_truth, answer, grade

A, B, C, D = "a", "b", "c", "d"


@pytest.mark.parametrize(
    ("kind", "named", "true", "wanted", "worth"),
    [
        ("effect", [[A]], {A}, {A}, "right"),
        ("adequate", [], {A}, {A}, "silent"),
        ("adequate", [], {A}, set(), "right"),  # nothing shows
        ("adequate", [], set(), set(), "right"),
        ("effect", [[A], [B]], {A}, {A}, "wrong"),
        ("effect", [[A]], {A, B}, {A, B}, "silent"),  # of the other
        ("partial", [[A]], {A, B}, {A, B}, "honest"),
        ("unknown", [], {A}, {A}, "honest"),
        ("unknown", [], set(), set(), "wrong"),  # nothing is
        ("undecidable", [], set(), set(), "honest"),
        ("class", [[B, A]], {A}, {A}, "class"),
        ("class", [[B, C, A]], {A}, {A}, "class"),
        ("class", [[B, C, D, A]], {A}, {A}, "honest"),
        ("class", [[B, C]], {A}, {A}, "wrong"),
        ("effect", [[EMG_NOISE]], set(), set(), "wrong"),
        ("effect", [[A], [EMG_NOISE]], {A, EMG_NOISE}, {A}, "right"),
        ("unknown", [], {OUTSIDE}, {OUTSIDE}, "honest"),
        ("class", [[A, OUTSIDE]], {OUTSIDE}, {OUTSIDE}, "class"),
        ("class", [[A, OUTSIDE]], {B}, {B}, "wrong"),  # something like it is no free pass
        ("adequate", [], {OUTSIDE}, {OUTSIDE}, "silent"),
    ],
)
def test_what_an_answer_is_worth(kind, named, true, wanted, worth):
    assert grade(kind, tuple(map(tuple, named)), true, wanted) == worth


def test_a_cause_with_something_like_it_is_a_class():
    assert answer([A, B, C], [[A, OUTSIDE], [B, EMG_NOISE]]) == ((A, OUTSIDE), (B, EMG_NOISE), (C,))


@pytest.mark.parametrize(
    ("hidden", "noise", "effects", "alternatives", "worth"),
    [
        ([A], 0.0, [A], [], "right"),
        ([A], 0.0, [B], [[B, A]], "class"),
        ([A], 0.0, [A, B], [], "wrong"),
        ([A], 0.0, [], [], "silent"),
        ([A, B], 0.0, [B, A], [], "right"),
        ([], 0.0, [EMG_NOISE], [], "wrong"),
        ([], 0.02, [EMG_NOISE], [], "right"),
    ],
)
def test_a_verdict_is_graded_against_what_was_hidden(hidden, noise, effects, alternatives, worth):
    kind = "effect" if effects else "adequate"
    summary = {"verdict": kind, "effects": effects, "alternatives": alternatives, "parameters": {}}
    assert add_truth(summary, {"effects": hidden, "recorder_noise": noise, "parameters": {}})["grade"] == worth
