"""Elbow motion from EMG, and what the physics of the arm misses.

import myowave

trials = myowave.Trials.from_csv("data/bench_elbow/*.csv", test=["trial3"])
d = myowave.diagnose(trials)
print(d.verdict["verdict"], d.verdict["effects"])
d.page("bench_elbow.html")
"""

from importlib import import_module
from typing import Any

_WHERE = {"Trials": "myowave.data.trials", "diagnose": "myowave.notebook", "Diagnosed": "myowave.notebook"}


def __getattr__(name: str) -> Any:
    """Load what is asked for, by name: what stands here in an import statement would be part of the code of all rules.

    So `import myowave` alone loads nothing, as the workflow needs only settings.
    """
    if name not in _WHERE:
        raise AttributeError(f"module 'myowave' has no {name!r}; it has {', '.join(_WHERE)}.")
    return getattr(import_module(_WHERE[name]), name)


def __dir__() -> list[str]:
    return [*globals(), *_WHERE]
