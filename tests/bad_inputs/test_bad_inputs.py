"""What a user may give that is wrong: each case is answered by a sentence that names it, and never by a traceback.

A case is a category, a name, what is tried in an empty folder, and what has to be said of it: a pattern, or several
texts. What would make an answer wrong is refused; what is doubtful only is told.
"""

import re

import bad_effects as effects
import bad_networks as networks
import bad_recordings as recordings
import bad_settings as settings
import pytest


def cases(category, table, ask):
    """Cases of a table {name: (*what is given, what has to be said)}."""
    return [
        pytest.param(lambda folder, given=given: ask(folder, *given), says, id=f"{category}: {name}")
        for name, (*given, says) in table.items()
    ]


REFUSED = [
    *cases("session", recordings.REFUSED_IN_MEMORY, lambda _, spoil: recordings.in_memory(spoil)),
    *cases("settings of a session", recordings.REFUSED_OF_SETTINGS, lambda _, of: recordings.in_memory(dict, **of)),
    *cases("tidy files", recordings.REFUSED_TIDY, recordings.of_tidy_files),
    *cases("a tidy file", recordings.REFUSED_ONE_TIDY, lambda f, spoil: recordings.of_tidy_files(f, spoil, "trial2")),
    *cases("file", recordings.FILES, recordings.of_a_file),
    *cases(
        "settings", {f"{p} = {v!r:.40}": (p, v, s) for p, v, s in settings.VALUES}, lambda _, *a: settings.of_value(*a)
    ),
    *cases("settings of a session", settings.SESSIONS, lambda _, changes: settings.of_session(**changes)),
    *cases("settings of a study", settings.STUDIES, lambda _, changes: settings.of_study(**changes)),
    *cases("checkpoint", networks.CHECKPOINTS, networks.of_checkpoint),
    *cases("stream", networks.STREAMS, lambda _, spoil: networks.of_stream(spoil)),
    *cases("stream", networks.ASKED, lambda _, asked: networks.of_stream(lambda lines: None, **asked)),
    *cases("effect file", effects.FILES, effects.of_file),
]
TOLD = [
    *cases("session", recordings.TOLD_IN_MEMORY, lambda _, spoil: recordings.in_memory(spoil)),
    *cases("envelopes", recordings.TOLD_OF_ENVELOPES, lambda _, spoil: recordings.in_memory(spoil, "envelope", "au")),
    *cases("maximum contractions", recordings.TOLD_OF_MAXIMA, lambda _, spoil: recordings.of_maxima(spoil)),
    *cases("settings of a session", recordings.TOLD_OF_SETTINGS, lambda _, of: recordings.in_memory(dict, **of)),
    *cases("tidy files", recordings.TOLD_TIDY, recordings.of_tidy_files),
    *cases("format", recordings.FORMATS, recordings.of_a_format),
]


def said_of(ask, folder):
    """What is said, and whether it was refused."""
    try:
        return ask(folder), False
    except ValueError as error:
        return str(error), True


def is_said(says, text):
    return all(part in text for part in says) if isinstance(says, tuple) else re.search(says, text)


@pytest.mark.parametrize(("ask", "says"), REFUSED)
def test_what_would_make_an_answer_wrong_is_refused(tmp_path, ask, says):
    text, refused = said_of(ask, tmp_path)
    assert refused and is_said(says, text), text
    assert max(map(len, text.splitlines())) < 1000


@pytest.mark.parametrize(("ask", "says"), TOLD)
def test_what_is_doubtful_is_told(tmp_path, ask, says):
    text, _ = said_of(ask, tmp_path)
    assert is_said(says, text), text


def test_nothing_is_said_of_what_is_right(tmp_path):
    (note,) = recordings.in_memory(lambda trials: None).splitlines()
    assert note.startswith("c emg_biceps EMG above 1: reaches 1.0")
    assert recordings.in_memory(recordings.made(recordings.noisy)) == note
    assert not recordings.of_maxima(dict) and not recordings.of_maxima(dict, times=40.0)
    cut = recordings.in_memory(recordings.artefacts, cut_s={"a": [0.0, 4.5]}).splitlines()
    assert not [told for told in cut if not told.startswith("c emg_biceps EMG above 1")]
    assert len(recordings.in_memory(recordings.artefacts).splitlines()) >= 3
    assert not recordings.of_tidy_files(tmp_path, lambda frame: frame)
    assert (
        not networks.of_stream(lambda lines: None) and not effects.of_file(tmp_path, {}) and not settings.of_session()
    )


def test_what_chance_makes_of_clocks_in_short_sessions_is_not_told():
    told = [recordings.in_memory(dict, first=first) for first in range(100, 400, 10)]
    assert not [text for text in told if "clocks" in text]
