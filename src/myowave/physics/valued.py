"""A model with values for all its parameters, stacked for arithmetic.

Shapes: ... batch (hypotheses, starts, perturbations), T trials, M muscles.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import torch
from torch import Tensor

from myowave.physics.constants import CURVE, CURVE_CONSTANTS, GROUP_CONSTANTS, MUSCLE_CONSTANTS, OVER_TIME
from myowave.physics.curves import Curves, Shape
from myowave.physics.effect import Acting, Effect, call
from myowave.physics.joint import Forearm, forearm
from myowave.physics.model import Model, Params
from myowave.physics.path import Path, SideBySide, StraightPath


@dataclass(frozen=True)
class Valued:
    """A model with values for all its parameters, stacked for arithmetic. Make it with `give_values`.

    `muscle` values are (..., T, M), `joint` values (..., T), each with `axes` axes of length 1 put in after T. `path`
    holds the constants that only some muscles have, by full name, `curve` the shapes of the muscle curves, (..., T).
    """

    model: Model
    muscle: Mapping[str, Tensor]
    joint: Mapping[str, Tensor]
    path: Mapping[str, Tensor]
    effect: Mapping[str, Mapping[str, Tensor]]
    curve: Mapping[str, Tensor]
    axes: int = 0

    def along(self, axes: int) -> "Valued":
        """The same values, broadcastable to quantities with `axes` more axes (time, points) after the trials."""
        assert self.axes == 0
        effect = {
            e.name: {n: _insert(v, axes, muscles=e.on_muscles(n)) for n, v in self.values(e).items()}
            for e in self.model.effects
        }
        return replace(
            self,
            muscle={n: _insert(v, axes, muscles=True) for n, v in self.muscle.items()},
            joint={n: _insert(v, axes, muscles=False) for n, v in self.joint.items()},
            path={n: _insert(v, axes, muscles=False) for n, v in self.path.items()},
            effect=effect,
            curve={n: _insert(v, axes, muscles=False) for n, v in self.curve.items()},
            axes=axes,
        )

    def timed(self, change: Tensor | None) -> "Valued":
        """The same with the first of the constants `OVER_TIME` changed, by a tensor (..., V) of quantities (...)."""
        # ASSUME: an upper arm that leans over time turns gravity; what its own acceleration does to the forearm is left
        # out.
        if change is None:
            return self
        moved = zip(OVER_TIME, change.unbind(-1), strict=False)
        joint = {**self.joint, **{name: self.joint[name] + x for name, x in moved}}
        changed = replace(self, joint=joint)
        made = {
            "combined": replace(self.combined, tilt=joint["tilt"], motor=joint["motor"] * joint["drive"]),
            "curves": self.curves,
            "acting": self.acting,
        }
        vars(changed).update(made)  # no need to make anew
        return changed

    def values(self, effect: Effect) -> Mapping[str, Tensor]:
        """The values of an effect's parameters, by their short names."""
        return self.effect[effect.name]

    @cached_property
    def acting(self) -> Mapping[str, tuple[Acting, ...]]:
        """The effects with their values, by `Model.places`."""
        places = self.model.places.items()
        return {place: tuple(Acting(e, self.effect[e.name]) for e in effects) for place, effects in places}

    @cached_property
    def driving(self) -> Mapping[str, Tensor]:
        """The side of the muscles and those of their constants that may change their drive."""
        return {n: v for n, v in self.muscle.items() if n == "side" or MUSCLE_CONSTANTS[n].drives}

    @cached_property
    def combined(self) -> "Combined":
        """Combinations of the constants that the equation of motion needs at every step."""
        c = self.muscle
        pennate = _counts(c["pennation"])
        leaning = _counts(self.joint["tilt"])
        load = self.joint["load"]
        return Combined(
            path=self._paths(),
            height=c["l0"] * torch.sin(c["pennation"]) if pennate else None,
            forearm=(body := forearm(self.joint)),
            inertia=body.inertia_with(load),
            weight=body.weight_with(load),
            tilt=self.joint["tilt"] if leaning else None,
            motor=self.joint["motor"] * self.joint["drive"] if _counts(self.joint["motor"]) else None,
            braking=self.joint["braking"] * self.joint["drive"] if _counts(self.joint["braking"]) else None,
        )

    @cached_property
    def forearm(self) -> Mapping[str, Tensor]:
        """Constants of the joint, and what effects may ask of any kind of forearm."""
        combined = self.combined
        return {**self.joint, "inertia": combined.forearm.inertia_with(0.0), "weight": combined.weight}

    @cached_property
    def curves(self) -> Curves:
        """The muscle curves, for quantities (..., M)."""
        return self._shaped({name: value.unsqueeze(-1) for name, value in self.curve.items()})

    @cached_property
    def curves_of_joint(self) -> Curves:
        """The same for quantities (...), as an effect on the joint has them."""
        return self._shaped(self.curve)

    def _shaped(self, shape: Mapping[str, Tensor]) -> Curves:
        changed = any(_counts(value) for value in shape.values())
        return self.model.curves.shaped(Shape(**shape)) if changed else self.model.curves

    def _paths(self) -> Path | SideBySide:
        c, muscles = self.muscle, self.model.muscles
        if all(isinstance(m.path, StraightPath) for m in muscles):
            return StraightPath(c["l1"], c["l2"], c["side"])

        def value(i: int, name: str) -> Tensor:
            return c[name][..., i] if name in c else self.path[f"{name}_{muscles[i].name}"]

        valued = (m.path.with_constants({n: value(i, n) for n in m.path.constants}) for i, m in enumerate(muscles))
        return SideBySide(tuple(valued))


@dataclass(frozen=True)
class Combined:
    """Combinations of constants: see `path`, `muscle.fibre_state` (height) and `joint` (forearm, and with its load the
    moment of inertia and the moment of the weight; tilt, motor and braking, None where they are 0)."""

    path: Path | SideBySide
    height: Tensor | None
    forearm: Forearm
    inertia: Tensor
    weight: Tensor
    tilt: Tensor | None
    motor: Tensor | None = None
    braking: Tensor | None = None


def give_values(model: Model, params: Params, like: Tensor) -> Valued:
    """Give values to a model's parameters; those not in `params` take their defaults.

    Args:
        params: name -> value, each a number or a tensor broadcastable to (..., T).
        like: a tensor whose dtype and device the values take.

    Raises:
        ValueError: for a name the model does not have.
    """
    model.check_names(params)
    full = {n: _value(params.get(n, default), like) for n, default in model.defaults.items()}
    muscle = {c: _stack([full[f"{c}_{m.name}"] for m in model.muscles], like) for c in model.common_constants}
    muscle |= _scaled(model, muscle, full)
    path = {f"{c}_{m.name}": full[f"{c}_{m.name}"] for m in model.muscles for c in m.nominal if c not in muscle}
    muscle["side"] = torch.tensor([m.side for m in model.muscles], dtype=like.dtype, device=like.device)
    joint = {c: full[c] for c in model.joint}
    effect = {}
    for e in model.effects:
        values = {}
        for short in e.parameters:
            stacked = _stack([full[n] for n in model.names(e, short)], like)
            values[short] = stacked if e.on_muscles(short) else stacked.squeeze(-1)
        effect[e.name] = values
        if e.acts_on == "constants":
            changed = call(e.function, {**muscle, **joint}, values)
            if strange := sorted(set(changed) - set(muscle) - set(joint)):
                raise ValueError(
                    f"effect {e.name!r} returns values for {', '.join(strange)}, which are not constants; "
                    f"there are {', '.join((*model.common_constants, *joint))}."
                )
            muscle.update({n: v for n, v in changed.items() if n in muscle})
            joint.update({n: v for n, v in changed.items() if n in joint})
    curve = {c: full[f"{c}_{CURVE}"] for c in CURVE_CONSTANTS if model.muscles}
    return Valued(model, muscle, joint, path, effect, curve)


def _counts(value: Tensor) -> bool:
    """Whether a constant that does nothing at 0 is there: it is not 0, or its derivative is asked for."""
    return value.requires_grad or bool((value != 0).any())


def _scaled(model: Model, muscle: Mapping[str, Tensor], full: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Constants of the muscles that the factors of their groups change, (..., T, M)."""
    changed: dict[str, Tensor] = {}
    for name, constant in GROUP_CONSTANTS.items() if model.groups else ():
        none = torch.ones_like(full[f"{name}_{model.groups[0]}"])
        factor = _stack([full[f"{name}_{m.group}"] if m.group else none for m in model.muscles], none)
        changed |= {c: muscle[c] * factor for c in constant.scales}
    return changed


def _value(value: Tensor | float, like: Tensor) -> Tensor:
    return torch.atleast_1d(torch.as_tensor(value, dtype=like.dtype, device=like.device))


def _stack(values: Sequence[Tensor], like: Tensor) -> Tensor:
    if not values:  # of an arm without muscles
        return like.new_zeros(0)
    # One value after the other in memory, as `dynamics.muscle_quantities` has quantities of muscles.
    return torch.stack(torch.broadcast_tensors(*values)).movedim(0, -1)


def _insert(value: Tensor, axes: int, *, muscles: bool) -> Tensor:
    """Put `axes` axes of length 1 behind the trials; a bare (M,) vector broadcasts as it is."""
    shape = value.shape
    if not muscles:
        return value.reshape(*shape, *(1,) * axes)
    return value if len(shape) < 2 else value.reshape(*shape[:-1], *(1,) * axes, shape[-1])
