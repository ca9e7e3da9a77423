"""From a folder of very short raw recordings to a verdict: few seconds must not cost many, and never a traceback."""

from contextlib import chdir
from pathlib import Path

import numpy as np
import pytest
from sessions import ANGLE_HZ, EMG_HZ, session_section, write_session

from myowave.data.importing import import_trials
from myowave.diagnosis.search.diagnose import diagnose
from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.settings import RecordedDataset
from myowave.starting.new import begin


def seconds_of(seconds):
    """Cuts a session's signals to so many seconds."""
    return lambda trial, key, values: values[: int(seconds * (EMG_HZ if key in ("biceps", "triceps") else ANGLE_HZ))]


def test_trials_of_two_seconds_get_an_answer(workplace, laid_over):
    write_session(Path("curls"), ("a", "b", "c", "d"), seconds_of(2.2))
    begin("mine", Path("curls"))
    settings = laid_over(Path("mine.yaml").read_text())
    dataset, physics = settings.data.datasets["mine"], settings.physics_of("mine")
    prepared, _ = import_trials("mine", dataset, physics.tables)
    base, known = build_model("base", physics), catalogue(())
    effects = [known[name] for name in ("joint_damping", "hand_load", "activation_dynamics", "extra_delay")]
    found = diagnose(prepared.trials, base, effects, dataset.identify, settings.diagnosis)
    # Half a curl, alike in all trials, is followed by many a model; what is missing in the usual one is seen.
    assert found.verdict.kind not in ("adequate", "undecidable")
    assert np.isfinite(found.rungs[0].heldout.rmse)


def test_trials_too_short_to_process_are_refused(workplace):
    write_session(Path("curls"), change=seconds_of(1.5))
    with chdir("curls"), pytest.raises(ValueError, match="150 samples in 1.5 s; expected at least 2 s.*a/biceps"):
        import_trials("mine", RecordedDataset(**session_section()))
