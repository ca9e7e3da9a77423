"""A model with values for all its parameters, stacked for arithmetic.

Shapes: ... batch (hypotheses, starts, perturbations), T trials, M muscles.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from myowave.physics.constants import CURVE, CURVE_CONSTANTS, GROUP_CONSTANTS, MUSCLE_CONSTANTS, OVER_TIME, names_of
from myowave.physics.curves import Curves
from myowave.physics.effect import Acting
from myowave.physics.joint import forearm
from myowave.physics.model import Model, Params
from myowave.physics.path import Path, SideBySide, StraightPath


@dataclass(frozen=True)
class Valued:
    """A model with values for all its parameters and what follows from them once for all. Made by `give_values`."""

    model: Model
    # constants of the muscles and their `side`, (..., T, M); not those that only some paths have
    muscle: Mapping[str, Tensor]
    # constants of the joint, and of any kind of forearm `inertia` without load and `weight` with it, (..., T)
    joint: Mapping[str, Tensor]
    acting: Mapping[str, tuple[Acting, ...]]  # the effects with their values, by `Model.places`
    path: Path | SideBySide  # of all muscles
    height: Tensor | None  # of the fibres over the tendon, see `muscle.fibre_state`; None where no muscle is pennate
    curves: Curves  # of the muscles, for quantities (..., M)
    joint_curves: Curves  # the same for quantities (...), as an effect on the joint has them
    inertia: Tensor  # of the forearm with its load [kg m^2]

    def timed(self, change: Tensor | None) -> "Valued":
        """The same with the first of the constants `OVER_TIME` changed, by a tensor (..., V) of quantities (...)."""
        # ASSUME: an upper arm that leans over time turns gravity; what its own acceleration does to the forearm is left
        # out.
        if change is None:
            return self
        moved = {n: self.joint[n] + x for n, x in zip(OVER_TIME, change.unbind(-1), strict=False)}
        return replace(self, joint={**self.joint, **moved})


def along(params: Params, axes: int, like: Tensor) -> dict[str, Tensor]:
    """Parameters (..., T) broadcastable to quantities with `axes` more axes (time, points) behind the trials.

    Args:
        like: a tensor whose dtype and device the values take.
    """
    values = {name: torch.as_tensor(value, dtype=like.dtype, device=like.device) for name, value in params.items()}
    return {name: v.reshape(*v.shape, *(1,) * axes) if v.ndim else v for name, v in values.items()}


def give_values(model: Model, params: Params, like: Tensor) -> Valued:
    """Give values to a model's parameters; those not in `params` take their defaults.

    Args:
        params: name -> value, each a number or a tensor broadcastable to (..., T).
        like: a tensor whose dtype and device the values take.

    Raises:
        ValueError: for a name the model does not have, or an effect that returns values for what is no constant.
    """
    if unknown := sorted(params.keys() - model.defaults.keys()):
        has = ", ".join(sorted(model.defaults))
        raise ValueError(f"model {model.name}: no parameter {', '.join(unknown)}; it has {has}")
    full = {name: torch.atleast_1d(value) for name, value in along({**model.defaults, **params}, 0, like).items()}
    muscle = {c: _stack([full[f"{c}_{m.name}"] for m in model.muscles], like) for c in model.common_constants}
    muscle |= _scaled(model, muscle, full)
    muscle["side"] = torch.tensor([m.side for m in model.muscles], dtype=like.dtype, device=like.device)
    joint = {c: full[c] for c in model.joint}
    acting = {}
    for effect in model.effects:
        stacked = {short: _stack([full[n] for n in model.names(effect, short)], like) for short in effect.parameters}
        values = {short: v if effect.on_muscles(short) else v.squeeze(-1) for short, v in stacked.items()}
        acting[effect.name] = Acting(effect, values)
        if effect.acts_on == "constants":
            changed = acting[effect.name]({**muscle, **joint})
            if strange := sorted(set(changed) - set(muscle) - set(joint)):
                raise ValueError(
                    f"effect {effect.name!r} returns values for {', '.join(strange)}, which are not constants; "
                    f"there are {', '.join((*model.common_constants, *joint))}."
                )
            muscle.update({n: v for n, v in changed.items() if n in muscle})
            joint.update({n: v for n, v in changed.items() if n in joint})
    body = forearm(joint)
    shape = {c: full[f"{c}_{CURVE}"] for c in CURVE_CONSTANTS if model.muscles}
    return Valued(
        model,
        muscle,
        joint | {"inertia": body.inertia, "weight": body.weight_with(joint["load"])},
        {place: tuple(acting[effect.name] for effect in effects) for place, effects in model.places.items()},
        _paths(model, muscle, full),
        height=muscle["l0"] * torch.sin(muscle["pennation"]) if _counts(muscle["pennation"]) else None,
        curves=_shaped(model.curves, {name: value.unsqueeze(-1) for name, value in shape.items()}),
        joint_curves=_shaped(model.curves, shape),
        inertia=body.inertia_with(joint["load"]),
    )


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


def _paths(model: Model, muscle: Mapping[str, Tensor], full: Mapping[str, Tensor]) -> Path | SideBySide:
    """The paths of all muscles; constants that all of them have may have been changed by an effect."""
    kinds: dict[type[Path], list[int]] = {} if model.muscles else {StraightPath: []}
    for i, m in enumerate(model.muscles):
        kinds.setdefault(type(m.path), []).append(i)

    def constants(kind: type[Path], places: list[int]) -> dict[str, Tensor]:
        names = names_of(MUSCLE_CONSTANTS, kind.kind)
        own = {n: [full[f"{n}_{model.muscles[i].name}"] for i in places] for n in names if n not in muscle}
        return {n: muscle[n] if n in muscle else _stack(own[n], full["mass"]) for n in names}

    paths = [kind.side_by_side([model.muscles[i].path for i in of], constants(kind, of)) for kind, of in kinds.items()]
    return paths[0] if len(paths) == 1 else SideBySide(tuple(map(tuple, kinds.values())), tuple(paths))


def _shaped(curves: Curves, shape: Mapping[str, Tensor]) -> Curves:
    return curves.shaped(shape) if any(_counts(value) for value in shape.values()) else curves


def _stack(values: Sequence[Tensor], like: Tensor) -> Tensor:
    if not values:  # of an arm without muscles
        return like.new_zeros(0)
    # One value after the other in memory, as `dynamics.muscle_quantities` has quantities of muscles.
    return torch.stack(torch.broadcast_tensors(*values)).movedim(0, -1)
