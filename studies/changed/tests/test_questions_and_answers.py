"""What is done to trials stays hidden, and a grade says how much of it an answer tells."""

import numpy as np
import pandas as pd
import pytest

from studies.changed.answers import answer, grade, table, trials_needed
from studies.changed.questions import DT_S, GAIN, HEAVY, LATE, LIGHT, LOAD, PERSON, of_arms, of_person, trials_of


def test_questions_of_the_person_are_all_that_three_trials_of_each_load_allow():
    asked = [*of_person()]
    assert len(asked) == len({(q.done, *q.groups.reference, "/", *q.groups.against, *q.channels) for q in asked})
    for question in asked:
        reference, against = question.groups.reference, question.groups.against
        assert not set(reference) & set(against) and {*reference, *against} <= {*LIGHT, *HEAVY}
        loads = [sum(name in HEAVY for name in group) / len(group) for group in (reference, against)]
        assert loads == ([0, 1] if "more" in question.done else [1, 0]) or question.truth != LOAD
        assert question.done != "nothing" or (loads[0] == loads[1] and not question.truth)
    assert sum(q.done == "nothing" for q in asked) == 6 + 18


@pytest.mark.parametrize("done", ["0.4 kg more", "0.3 rad more lean", "nothing", "EMG 63 ms late"])
def test_what_was_done_to_an_arm_is_seen_in_the_second_group_alone_and_told_nowhere(model, done):
    arms = {q.done: q for q in of_arms(5, 1) if q.of == "as the model"}
    plain, changed = (trials_of(arms[name], None, model) for name in ("nothing", done))
    assert changed.conditions == {} and changed.dt == pytest.approx(DT_S)
    first, second = (slice(0, 3), slice(3, 6))
    np.testing.assert_array_equal(changed.angle[first], plain.angle[first])
    np.testing.assert_array_equal(changed.emg[first], plain.emg[first])
    if arms[done].truth == LATE:
        np.testing.assert_array_equal(changed.emg[second, 2:], plain.emg[second, :-2])
    else:
        same = np.allclose(changed.angle[second], plain.angle[second])
        assert same == (done == "nothing")


def test_a_recorder_adds_noise_and_filters(model):
    asked = {q.of: q for q in of_arms(5, 1) if q.done == "nothing"}
    plain, noisy, smooth = (
        trials_of(asked[of], None, model)
        for of in ("as the model", "EMG with noise of 0.02", "angle behind a filter of 6 Hz")
    )
    inside = plain.emg > 0.1
    assert (noisy.emg - plain.emg)[inside].std() == pytest.approx(0.02, rel=0.05)
    rough = [np.diff(trials.angle, 3).std() for trials in (plain, smooth)]
    assert rough[1] < 0.6 * rough[0]
    np.testing.assert_array_equal(noisy.angle, plain.angle)


@pytest.mark.parametrize(
    ("truth", "names", "verdict", "expected"),
    [
        (LOAD, ("hand_load",), "effect", "right"),
        (LATE, ("extra_delay", "clock_shift"), "class", "right"),
        (LATE, ("extra_delay",), "effect", "right"),
        (GAIN, ("angle_scale", "emg_gain"), "class", "class"),
        (LOAD, ("constant_torque",), "effect", "wrong"),
        (LOAD, (), "undecidable", "honest"),
        (LOAD, (), "adequate", "silent"),
        (frozenset(), (), "adequate", "right"),
        (frozenset(), (), "undecidable", "honest"),
        (frozenset(), ("clock_shift",), "effect", "wrong"),
    ],
)
def test_a_grade_says_how_much_an_answer_tells(truth, names, verdict, expected):
    assert grade(truth, names, verdict) == expected


def test_answers_come_to_counts_sizes_and_trials_needed():
    groups = [(LIGHT[:few], HEAVY[:many]) for few in (1, 2, 3) for many in (1, 2, 3)]
    rows = pd.DataFrame(
        {
            "of": PERSON,
            "done": "1.25 kg more",
            "reference": [" ".join(light) for light, _ in groups],
            "against": [" ".join(heavy) for _, heavy in groups],
            "grade": ["right" if min(len(light), len(heavy)) > 1 else "silent" for light, heavy in groups],
            **{"size_true": 1.25, "size_found": 1.0, "size_low": 0.5, "size_high": [1.0] + 8 * [2.0]},
        }
    )
    (_, _, line) = table(rows, "done").splitlines()
    assert [cell.strip() for cell in line.split("|")[1:-1]] == [
        *("1.25 kg more", "4", "", "", "5", "", "1 to 1 (1.25)", "8 of 9")
    ]
    # Two of each are among the first four of six in C(4, 2) C(2, 1) = 12 of C(6, 3) = 20 orders.
    needed = trials_needed(rows)
    assert sum(needed.values()) == 20 and needed == {4: 12, 5: 8}


def test_an_answer_is_graded_with_its_size(model, effects, settings):
    (question, *_) = (q for q in of_arms(5, 1) if q.truth == LOAD)
    few = [effects["hand_load"], effects["constant_torque"]]
    row = answer(question, None, {"arm": model}, few, settings.diagnosis.scatter)
    assert (row["names"], row["grade"]) == ("hand_load", "right")
    assert row["size_low"] < 0.4 < row["size_high"]
