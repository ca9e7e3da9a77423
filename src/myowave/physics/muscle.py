"""One muscle: its activation (Eq. 2) and its fibre (Eqs. 46-48); see `curves` for its force, `path` for its path.

Every function acts element-wise; muscles stand side by side on the last axis M.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import torch
from torch import Tensor

from myowave.physics.constants import MUSCLE_CONSTANTS, names_of
from myowave.physics.curves import Curves
from myowave.physics.path import Path

FLEXOR, EXTENSOR = 1.0, -1.0


@dataclass(frozen=True)
class Muscle:
    """A muscle group."""

    name: str
    side: float  # of the joint on which it runs, +1 for a flexor and -1 for an extensor
    channel: str  # its EMG
    constants: Mapping[str, float] = field(hash=False)  # those that every muscle has, in SI units
    path: Path  # over the joint, with constants of its own
    group: str = ""  # of muscles that share the factors of `constants.GROUP_CONSTANTS`; empty for none

    def __post_init__(self) -> None:
        assert self.side in (FLEXOR, EXTENSOR), self.side
        assert set(self.constants) == set(names_of(MUSCLE_CONSTANTS, "")), sorted(self.constants)
        assert getattr(self.path, "side", self.side) == self.side, self.name

    @property
    def nominal(self) -> dict[str, float]:
        """All constants of the muscle, with those of its path."""
        both = {**self.constants, **self.path.constants}
        return {name: float(both[name]) for name in MUSCLE_CONSTANTS if name in both}


def activation(excitation: Tensor, shape: Tensor) -> Tensor:
    """Muscle activation a(u) in [0, 1] for u in [0, 1], Eq. 2; to first order in A, a = u (1 + A (u - 1) / 2).

    Args:
        excitation: u, EMG after the electromechanical delay [-], any shape.
        shape: shape factor A [-], broadcastable to `excitation`.

    Source: Taneja et al. 2023, Eq. 2.
    """
    # ASSUME: an excitation that an effect has made negative counts as 0, as negative EMG does.
    u = excitation.clamp(min=0.0)
    small = shape.abs() < 1e-6  # where Eq. 2 is 0 / 0, or next to it
    safe = torch.where(small, 1.0, shape)
    linear = u * (1.0 + shape * (u - 1.0) / 2.0)
    return torch.where(small, linear, torch.special.expm1(safe * u) / torch.special.expm1(safe))


def fibre_state(
    length: Tensor, velocity: Tensor, *, l0: Tensor, vmax: Tensor, slack: Tensor, height: Tensor | None
) -> tuple[Tensor, Tensor, Tensor | float]:
    """Normalised fibre length and velocity and the cosine of the pennation angle, with a rigid tendon.

    Args:
        length, velocity: of the muscle-tendon unit [m, m/s], lengthening positive.
        height: of the fibre over the tendon, l0 sin(pennation at l0) [m]; None where no muscle is pennate.

    Source: Taneja et al. 2023, Eqs. 46-48.
    """
    # ASSUME: fibres keep their height l0 sin(pennation) over the tendon (Scott & Winter 1991), so that Eq. 47 can be
    # solved for the fibre length. A muscle-tendon unit shorter than its tendon has a fibre of length ~0 and no force.
    along = (length - slack).clamp(min=1e-6)
    if height is None:
        return along / l0, velocity / vmax, 1.0
    fibre = torch.sqrt(along**2 + height**2)
    cosine = along / fibre
    return fibre / l0, velocity * cosine / vmax, cosine


def mean_of_antagonists(excitation: Tensor, side: Tensor) -> Tensor:
    """Mean excitation over the antagonists of each muscle, (..., M); 0 where there is none.

    Args:
        side: of each muscle, (M,).
    """
    opposite = (side[..., :, None] * side[..., None, :] < 0).to(excitation.dtype)
    share = opposite / opposite.sum(-1, keepdim=True).clamp(min=1.0)
    return excitation @ share.transpose(-1, -2)


def share_of(family: Curves) -> Callable[..., Tensor]:
    """The function of an effect that gives a share w of the force to other curves, in the shape of the base model's."""

    def other_force(
        force: Tensor,
        base_force: Tensor,
        activation: Tensor,
        fibre_length: Tensor,
        fibre_velocity: Tensor,
        curves: Curves,
        *,
        w: Tensor,
    ) -> Tensor:
        """Force of the fibre [f0] with a share w of the other curves and 1 - w of the base model's."""
        other = curves.in_shape(family).force(activation, fibre_length, fibre_velocity)
        return force + w * (other - base_force)

    return other_force
