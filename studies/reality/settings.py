"""The section `reality`: what is asked of recordings whose truth nobody here made."""

from typing import Annotated, Literal

from myowave.settings import Settings
from myowave.settings.configuration import shipped_effects
from myowave.settings.data import Changed
from myowave.settings.keys import unless_known
from myowave.settings.section import Name, Once, Real, Section, TrialName, WithoutNull, setting
from studies.shared import StudySection


class PutIn(Section):
    """What is done by hand to the EMG of some trials before anybody sees it."""

    trials: Annotated[tuple[TrialName, ...], Once] = setting("trials it is done to", min_length=1)
    channels: Annotated[tuple[Name, ...], Once] = setting("channels it is done to; all where none is named", default=())
    gain: Real = setting("factor on the EMG", "-", 1.0, ge=0)
    delay_s: Real = setting("how much later the EMG comes", "s", 0.0, ge=0)


class Case(Section):
    """One question to one dataset."""

    dataset: Name = setting("trials, as their block in data.datasets says")
    kind: Literal["measured", "simulated"] = setting("who made the motion: a body or a machine, or a simulator")
    system: str = setting("what moves, for people", min_length=1)
    withheld: str = setting("what the diagnosis is not told, for people", min_length=1)
    leave_out: Annotated[tuple[Name, ...], Once] = setting("effects taken out of the catalogue", default=())
    told: dict[Name, Real] = setting("what it is told of all trials instead, {condition: value}", "SI", dict)
    put_in: PutIn | None = setting("what is done to the EMG by hand; null for nothing", default=None)
    changed: Changed | None = setting("asks what changed between these groups; null: what is missing", default=None)


class Reality(StudySection):
    """Questions to recordings whose truth nobody here made; the truth stands in truth.yaml."""

    cases: Annotated[dict[Name, Case], WithoutNull] = setting("questions, by name", each="case")

    def problems(self, settings: Settings) -> list[str]:
        """Datasets and effects that are not there."""
        found = []
        for name, case in self.cases.items():
            found += unless_known(f"cases.{name}.dataset", case.dataset, settings.data.datasets)
            for i, effect in enumerate(case.leave_out):
                found += unless_known(f"cases.{name}.leave_out[{i}]", effect, shipped_effects())
        return found
