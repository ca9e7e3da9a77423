"""Whether a dataset and its arm fit: constants that are named or given values, and channels that drive muscles."""

import operator
from collections.abc import Iterator, Mapping

from myowave.physics.constants import constant_of
from myowave.settings.data import Dataset, RecordedDataset
from myowave.settings.keys import in_words, unless_known
from myowave.settings.physics import Arm

_EFFECTS = (
    " A parameter of an effect is not set here: it is estimated wherever the model has the effect, within the bounds "
    "in the effect's file."
)
_WITHIN = {"gt": operator.gt, "ge": operator.ge, "lt": operator.lt, "le": operator.le}


def check_dataset(where: str, dataset: Dataset, arm: Arm) -> list[str]:
    """One line for each thing that a dataset, which stands at `where`, asks of its arm and does not find there."""
    whose, nominal = f" in arm {dataset.arm}", arm.nominal
    problems = []
    for path, name, values in _constants(dataset):
        problems += unless_known(f"{where}.{path}", name, nominal, whose, _EFFECTS if "." in name else "")
        if name in nominal:
            problems += _out_of_bounds(f"{where}.{path}", name, values)
    conditions = {f"conditions.{trial}": known for trial, known in dataset.conditions.items()}
    for at, known in {"constants": {}, **conditions}.items():
        problems += _problems_of_body(f"{where}.{at}", nominal | dataset.constants | known)
    for key, names in {
        "constants": dataset.constants,
        "conditions": {p for c in conditions.values() for p in c},
    }.items():
        problems += [
            f"{where}: {name} is both known ({key}) and to identify; keep one of them."
            for name in sorted({*names} & {*dataset.identify})
        ]
    problems += [
        f"{where}.identify.{name}: {name} is 0{whose}, so a search has nothing to start from. Give the arm the value "
        "that you expect, or leave it out."
        for name in dataset.identify
        if nominal.get(name) == 0
    ]
    return problems + (_problems_of_signals(where, dataset, arm) if isinstance(dataset, RecordedDataset) else [])


def _constants(dataset: Dataset) -> Iterator[tuple[str, str, dict[str, float]]]:
    """Where a dataset names a physical constant, which, and what values it gives it, by the key below that place."""
    known = {"constants": dataset.constants, "hidden_constants": getattr(dataset, "hidden_constants", {})}
    known |= {f"conditions.{trial}": conditions for trial, conditions in dataset.conditions.items()}
    for key, constants in known.items():
        yield from ((f"{key}.{name}", name, {"": value}) for name, value in constants.items())
    for name, choice in dataset.identify.items():
        bounds = {".low": choice.low, ".high": choice.high}
        yield f"identify.{name}", name, {key: value for key, value in bounds.items() if value is not None}
    for signal, angle in getattr(dataset, "signals", {}).items():
        if angle.condition:
            yield f"signals.{signal}.condition", angle.condition, {}


def _out_of_bounds(path: str, name: str, values: Mapping[str, float]) -> list[str]:
    """Those of the values that the physical constant of this name cannot have."""
    constant = constant_of(name)
    return [
        f"{path}{key} = {value:g}: expected a number, {', '.join(in_words(constant.bounds))} [{constant.unit}] "
        f"({constant.meaning})."
        for key, value in values.items()
        if not all(_WITHIN[bound](value, limit) for bound, limit in constant.bounds.items())
    ]


def _problems_of_body(at: str, constants: Mapping[str, float]) -> list[str]:
    """Whether a rigid forearm can have such an inertia."""
    if "com" not in constants or constants["inertia"] >= (least := constants["mass"] * constants["com"] ** 2):
        return []
    return [
        f"{at}: the forearm's inertia is {constants['inertia']:g}, but about the elbow it is at least mass com^2 = "
        f"{least:g} kg m^2; give mass, com and inertia together."
    ]


def _problems_of_signals(where: str, dataset: RecordedDataset, arm: Arm) -> list[str]:
    """Channels that the arm needs, and conditions that no angle can be."""
    problems = []
    for channel in arm.channels:
        if channel not in dataset.emg:
            driven = ", ".join(name for name, muscle in arm.muscles.items() if muscle.emg == channel)
            problems.append(
                f"{where}.emg: {channel}, which drives {driven} in arm {dataset.arm}, is not here; there are "
                f"{', '.join(dataset.emg) or 'none'}. Add the channel, or name another one as the emg of {driven}."
            )
    for signal, angle in dataset.signals.items():
        if angle.condition in arm.nominal and (unit := constant_of(angle.condition).unit) != "rad":
            problems.append(
                f"{where}.signals.{signal}.condition: {angle.condition} is in {unit}, and the signal is an angle; "
                "expected a constant in rad, such as tilt."
            )
    return problems
