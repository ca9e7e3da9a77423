"""What the predictors of the comparisons are called in tables, pictures and text, beside the models' own names."""

POSTURE = "posture and speed"
POSTURE_LOAD = "posture, speed and load"
EMG_ONLY = "EMG without physics"
HOLD = "hold the angle"
SAME_SPEED = "go on at the same speed"
NOISE = "noise of the angle"
HORIZON_BASELINES = (HOLD, SAME_SPEED, POSTURE, EMG_ONLY)
