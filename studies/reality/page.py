"""The page of the study: what was withheld and what was said, in words."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from myowave.diagnosis.causes import CAUSE_TITLES, OUTSIDE
from myowave.physics.effects import catalogue
from studies.reality.score import GRADES
from studies.shared import markdown

RUNAWAY = 60.0  # deg; what misses more follows no longer
PLAIN = {"adequate": "nothing", "unknown": "something unknown", "undecidable": "cannot be told"}
MOST_NAMES = 3  # of a rival's answer; of a longer one the page has the number
HEAD = """

Others recorded the machines and the person; OpenSim moves Arm26. What was withheld is read by the scorer alone.
**Many rows are no test**: [the method changed](#what-changed-after-answers-were-seen) after their answers had been
seen. `snakemake reality --cores 2` writes this page and `results/reality.csv`.

![What was withheld, what was said, and the error before and after.](reality.png)

"""
TAIL = """

- **graded**: *right*, all that is known to be missing is named; *right in part*, the same, but in classes of effects
  that these trials cannot tell apart, or with "something like it"; *left open*, only that something is missing, or a
  part of it, or that it cannot be told, or that unusual constants may hide it (column `masked` of the table has the
  effects that explain them); *missed*, that nothing is missing; *wrong*, a name of what is not there, or nothing more
  said to be missing where it is. That something else is missing, too, is no error: of a measured machine nobody knows
  all. [Simulated arms](study.md), of which all is known, are graded more strictly.
- **error**: of unseen trials, simulated from start to end with nothing added to the model, and with what is named or,
  where nothing is, comes nearest. None where only the torques of two groups were compared.
- **size**: friction per load of the gears [-]; load in the hand or on the rod [kg]; lean [rad]; the decay of Arm26's
  activation [s], its load [kg], its damper [N m s/rad].
- **lasso on torque** keeps what it needs of all effects, each as it changes the torque at its usual strength
  (`scikit-learn`, penalty by cross-validation). **PySINDy** keeps terms of the acceleration, where it is installed
  (`studies/reality/requirements.txt`) and the arm has no muscles. [Names of all effects](reality.csv).
- **servo and weight**: [data/servo_pendulum](https://github.com/Rhoban/bam). Its authors find friction in proportion to
  the load on the gears; damping and dry friction alone, the usual answer, lack that. Its size, 0.4, is of a quick fit
  to the free-running logs with no other friction. One of three gains is kept for testing.
  With the motor off its drops leave damping beside dry friction. Its authors have both, and a friction that is largest
  near rest.
- **pendulum in bearings**: [data/free_pendulum](https://github.com/dynamicslab/MultiArm-Pendulum). The second half of
  each swing is kept for testing.
- **rod on a motor**:
  [data/torque_pendulum](https://github.com/dfki-ric-underactuated-lab/torque_limited_simple_pendulum).
  A motor drives the rod with 0.9 or 1.5 N m along its motion, so that a motor with less torque and friction look alike:
  one weight and one torque cannot tell them, and the load of the heavy weight comes out twice too large. The authors
  identified dry friction and damping; that the rod bends shows as ringing after each switch of the torque. The light
  weight alone is tested with the torque of 1.5 N m, which it was not fitted to, the others with their last swings.
- **a person**: [data/elbow_curls](https://github.com/jiruifu-jerry0219/UpperLimbEstimator). The question is what
  changed between trials with one dumbbell and with another, or with what was done to the EMG by hand. Loads are taken
  as [pounds](person.md); the lean is what its sensor reads. What cannot be told is smaller than trials of this person
  differ anyway: [what is left open, and why](changed.md).
- **OpenSim's Arm26**: `data/arm26/trials`, simulated by OpenSim 4.6 (`studies/reality/arm26.py`). It has
  activation dynamics, elastic tendons and Thelen's curves: all of that is missing, even what the noise of 0.5 deg
  hides. One of four trials is kept for testing.

## What changed after answers were seen
- Servo and weight: a motor's gain is known to 10 % only; stops of a joint may grow far past its range; the search leads
  on from several models, as one effect had hidden two. The truth of the driven servo was widened, too: its gears have
  the dry friction and damping of the servo that is off. It was right in part ("dry friction, friction that grows with
  the load, or something like them, and something else") before the change for the rod. Now both come nearest, with a
  drag, but what they leave is no noise.
- Servo that is off: dry friction may be largest near rest, and how fast it grows from rest is estimated.
- All machines: steps of the solver are 2.5 ms at most, and a recorded torque has noise, both found on simulated rigs.
  At first that noise could be three times what the record shows; then the light rod had damping and a flexible mount,
  and nothing else, which is wrong. Now it is at most half more. A clock that drifts is fitted as an effect, found on
  simulated arms: two rows are worded otherwise, none is graded otherwise.
- Pendulum in bearings: what the catalogue has is no part of what it lacks, and how strong effects may be.
- Rod on a motor: before any change its light weight was "unknown", its heavy one "a load in the hand or something like
  it". Asked then about all its trials, the method named dry friction, friction that grows with the load and a sensor
  that lags by 0.15 s, "or something like them". The lag was wrong, for two reasons. What stands for unknown causes held
  a lag of the other sign; it holds no longer what the catalogue has of a sensor. And the catalogue had no rod that
  bends: a flexible mount of the sensor was added, to the truth, too. An angle that was smoothed would look the same.
  Since filters of the angle are sought otherwise (30 November 2026), the light weight is wrong where it was left open:
  that something else is missing is 12 % likely, not 79. Its two trials of 2.3 and 1.5 s hardly show dry friction: 3 %
  likely, and with the nine likeliest models 1 to 20 %, whichever of seven filters (or none) the angle has passed.
- A person: how changes between trials are weighed, with all seven rows in sight ([what changed](changed.md)).
- Arm26: tendons with a toe, lags that change with the activation, steeper passive forces, larger forces of lengthening
  muscles; unusual constants are told beside names. Unknown curves may hang on the activation, found on simulated arms:
  the damper's size came closer, no row is graded otherwise.

**Seven more arms of Arm26** were judged once each. Of five, two had all that is missing named, and nothing else (with a
damper and with a spring at the joint); three got a wrong name, noise of the EMG for elastic tendons. That was EMG
before a trial, to which muscles still answer and which nobody recorded (0.05 to 0.58 deg). It is a cause of its own
now; of two new arms, all that is missing was named and nothing else: strain of the tendons 0.033 +- 0.006 (true 0.033).

A case is a dataset and a line in `studies/reality/settings.yaml`, and what is true of it in
`studies/reality/truth.yaml`.
"""


def write_page(table: pd.DataFrame) -> str:
    """The page as Markdown.

    Args:
        table: as `score.score_cases` gives it.
    """
    heads = ["what moves", "withheld", "said", "size (true)", "error [deg]", "graded", "lasso on torque", "PySINDy"]
    rows = [
        [
            f"{row['system']} ({row['kind']})",
            row["withheld"],
            said(row),
            _size(row),
            error_before_after(row),
            GRADES[row["grade"]],
            *(_few(str(row[rival])) for rival in ("lasso", "pysindy")),
        ]
        for row in table.to_dict("records")
    ]
    return _answer(table["grade"]) + HEAD + markdown(heads, rows) + TAIL


def _answer(grades: pd.Series) -> str:
    """The title, and how many answers there are of each grade."""
    counts = grades.value_counts()
    told = ", ".join(f"{counts.get(grade, 'none')} {word}" for grade, word in GRADES.items())
    return f"# Is it right on machines and arms that others made?\n\nOf {len(grades)} answers {told}."


def _few(names: str) -> str:
    """What a rival names, or how many."""
    listed = names.split(", ")
    return f"{len(listed)} effects" if len(listed) > MOST_NAMES else names.replace("_", " ")


def said(row: Mapping[str, Any]) -> str:
    """The answer of a row in few words."""
    verdict, names, classes = row["verdict"], row["names"], row["class"]
    titles = CAUSE_TITLES | {name: effect.title for name, effect in catalogue().items()}
    if not names:
        near = ", ".join(titles[name] for name in filter(None, row["nearest"].split(", ")))
        return PLAIN.get(verdict, verdict) + f" (nearest: {near})" * bool(near)

    groups = [one.split(" or ") for one in classes.split("; ")]

    def told(name: str) -> str:
        others = {member for members in groups if name in members for member in members} - {name, OUTSIDE}
        more = f" (or {len(others)} other{'s' * (len(others) > 1)})" if others else ""
        return titles.get(name, name.replace("_", " ")) + more

    listed, hidden = names.split(", "), [name for name in row["masked"].split(", ") if name]
    like = f" or something like {'them' if listed[1:] else 'it'}" if any(OUTSIDE in g for g in groups) else ""
    more = "," * bool(like) + " and something else" if verdict == "partial" else ""
    hides = f" and perhaps one of {len(hidden)} (unusual constants)" if hidden else ""
    return ", ".join(map(told, listed)) + like + more + hides


def error_before_after(row: Mapping[str, Any]) -> str:
    """Both errors of a row [deg], one where they are the same; nothing where there are none."""
    errors = [row[key] for key in ("error_before", "error_after")]
    told = [f"{error:.2g}" if error < RUNAWAY else "runs away" for error in errors if pd.notna(error)]
    return " → ".join(dict.fromkeys(told))


def _size(row: Mapping[str, Any]) -> str:
    if pd.isna(row["size_true"]) or pd.isna(row["size_found"]):
        return ""
    return f"{row['size_found']:.2g}, {row['size_low']:.2g} to {row['size_high']:.2g} ({row['size_true']:.3g})"
