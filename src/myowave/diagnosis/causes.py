"""Causes of a misfit that are no effects on the model. Nothing heavy is imported here: scoring and pages read it."""

import math

NAMED = 0.95  # a name is given where it is as probable as this
LIKELY = 0.5  # what is likelier is told, without a name
SURE = math.log(NAMED / (1 - NAMED))  # nats for an effect that its name takes
EMG_NOISE = "emg_noise"  # what was recorded is not all that drove the arm
OWN_SHAPES = "muscle curves or paths of another shape"  # than the settings or an effect of the catalogue allow
LEFT = ("partial", "unknown")  # verdicts by which more is left than noise
OUTSIDE = "outside"  # in a class: something like it that the catalogue lacks
GAIN_PER_TRIAL = "gain_per_trial"
SILENT = "silent_electrode"  # what may have changed between two groups of trials: it reports nothing in one
CAUSE_TITLES = {
    EMG_NOISE: "noise of the recorded EMG",
    OWN_SHAPES: OWN_SHAPES,
    OUTSIDE: "something the catalogue lacks",
    GAIN_PER_TRIAL: "a gain of the EMG that differs between trials",
    SILENT: "an electrode that reports nothing",
}
