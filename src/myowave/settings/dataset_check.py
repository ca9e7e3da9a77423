"""Whether a dataset and its arm fit: constants that are named or given values, and channels that drive muscles."""

import operator
from collections.abc import Iterator, Mapping

from myowave.physics.constants import constant_of, constant_unit
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
    for path, constant in _names(where, dataset):
        problems += unless_known(path, constant, nominal, whose, _EFFECTS if "." in constant else "")
    for path, constant, value in _values(where, dataset):
        problems += _out_of_bounds(path, constant, value) if constant in nominal else []
    known = {"constants": dataset.constants, "conditions": {p for c in dataset.conditions.values() for p in c}}
    for key, constants in known.items():
        for constant in sorted(set(dataset.identify) & set(constants)):
            problems.append(f"{where}: {constant} is both known ({key}) and to identify; keep one of them.")
    for constant in dataset.identify:
        if nominal.get(constant) == 0:
            problems.append(
                f"{where}.identify.{constant}: {constant} is 0{whose}, so a search has nothing to start from. "
                "Give the arm the value that you expect, or leave it out."
            )
    for at, conditions in {"constants": {}, **{f"conditions.{t}": c for t, c in dataset.conditions.items()}}.items():
        problems += _problems_of_body(f"{where}.{at}", nominal | dataset.constants | conditions)
    if isinstance(dataset, RecordedDataset):
        problems += _problems_of_signals(where, whose, dataset, arm)
    return problems


def _names(where: str, dataset: Dataset) -> Iterator[tuple[str, str]]:
    """Where a dataset names a physical constant, and which."""
    yield from ((f"{where}.identify.{p}", p) for p in dataset.identify)
    yield from ((path, p) for path, p, _ in _known_values(where, dataset))
    for name, signal in getattr(dataset, "signals", {}).items():
        if signal.condition:
            yield f"{where}.signals.{name}.condition", signal.condition


def _values(where: str, dataset: Dataset) -> Iterator[tuple[str, str, float]]:
    """Where a dataset gives a value to a physical constant, which constant and what value."""
    yield from _known_values(where, dataset)
    for p, choice in dataset.identify.items():
        given = {"low": [choice.low], "high": [choice.high], "literature": choice.literature}
        for key, values in given.items():
            yield from ((f"{where}.identify.{p}.{key}", p, value) for value in values if value is not None)


def _known_values(where: str, dataset: Dataset) -> Iterator[tuple[str, str, float]]:
    hidden = getattr(dataset, "hidden_constants", {})
    sections = {"constants": dataset.constants, "hidden_constants": hidden}
    sections |= {f"conditions.{trial}": conditions for trial, conditions in dataset.conditions.items()}
    for key, constants in sections.items():
        yield from ((f"{where}.{key}.{p}", p, value) for p, value in constants.items())


def _out_of_bounds(path: str, name: str, value: float) -> list[str]:
    """No problem, or one: the value at `path` is none that the physical constant of this name may have."""
    constant = constant_of(name)
    if all(_WITHIN[bound](value, limit) for bound, limit in constant.bounds.items()):
        return []
    return [
        f"{path} = {value:g}: expected a number, {', '.join(in_words(constant.bounds))} [{constant.unit}] "
        f"({constant.meaning})."
    ]


def _problems_of_body(at: str, constants: Mapping[str, float]) -> list[str]:
    """Whether a rigid forearm can have such an inertia."""
    if "com" not in constants or constants["inertia"] >= (least := constants["mass"] * constants["com"] ** 2):
        return []
    return [
        f"{at}: the forearm's inertia is {constants['inertia']:g}, but about the elbow it is at least mass com^2 = "
        f"{least:g} kg m^2; give mass, com and inertia together."
    ]


def _problems_of_signals(where: str, whose: str, dataset: RecordedDataset, arm: Arm) -> list[str]:
    """Channels that the arm needs, and conditions that no angle can be."""
    problems = []
    for channel in arm.channels:
        if channel in dataset.emg:
            continue
        driven = [name for name, muscle in arm.muscles.items() if muscle.emg == channel]
        several = len(driven) > 1
        problems.append(
            f"{where}.emg: {'muscles' if several else 'muscle'} {', '.join(driven)}{whose} "
            f"{'are' if several else 'is'} driven by {channel}, which is not here; it has "
            f"{', '.join(dataset.emg) or 'none'}. Add the channel, or name another one as the emg of "
            f"{'these muscles' if several else 'the muscle'}."
        )
    for signal, angle in dataset.signals.items():
        if angle.condition in arm.parameters and (unit := constant_unit(angle.condition)) != "rad":
            problems.append(
                f"{where}.signals.{signal}.condition: {angle.condition} is in {unit}, and the signal is an angle; "
                "expected a constant in rad, such as tilt."
            )
    return problems
