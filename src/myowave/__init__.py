"""Elbow motion from EMG, and what the physics of the arm misses.

import myowave

trials = myowave.Trials.from_csv("data/bench_elbow/*.csv", test=["trial3"])
d = myowave.diagnose(trials)
print(d.verdict["verdict"], d.verdict["effects"])
d.page("bench_elbow.html")
"""

from importlib import import_module
from typing import Any

_NAMES = {"Trials": "TrialsOfFiles", "diagnose": "diagnose", "Diagnosed": "Diagnosed"}  # of `notebook`


def __getattr__(name: str) -> Any:
    """Load what is asked for, by name: what stands here in an import statement would be part of the code of all rules.

    So `import myowave` alone loads nothing, as the workflow needs only settings.
    """
    if name not in _NAMES:
        raise AttributeError(f"module 'myowave' has no {name!r}; it has {', '.join(_NAMES)}.")
    return getattr(import_module("myowave.notebook"), _NAMES[name])


def __dir__() -> list[str]:
    return [*globals(), *_NAMES]
