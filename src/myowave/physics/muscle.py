"""One muscle: from EMG to activation (Eqs. 1-2), its path over the joint (Eqs. 57-59), its force (Eqs. 45-50).

Every function acts element-wise; muscles stand side by side on the last axis M.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import torch
from torch import Tensor

from myowave.physics.constants import MUSCLE_CONSTANTS
from myowave.physics.curves import Curves

FLEXOR, EXTENSOR = 1.0, -1.0


@dataclass(frozen=True)
class Muscle:
    """A muscle group: its name, the side of the joint it runs on, its EMG channel and its constants (SI units)."""

    name: str
    side: float
    channel: str
    constants: Mapping[str, float] = field(hash=False)

    def __post_init__(self) -> None:
        assert self.side in (FLEXOR, EXTENSOR), self.side
        assert set(self.constants) == set(MUSCLE_CONSTANTS), sorted(self.constants)


def activation(excitation: Tensor, shape: Tensor) -> Tensor:
    """Muscle activation a(u) in [0, 1] for u in [0, 1], Eq. 2; the limit A -> 0 is a = u.

    Args:
        excitation: u, EMG after the electromechanical delay [-], any shape.
        shape: shape factor A [-], broadcastable to `excitation`.

    Source: Taneja et al. 2023, Eq. 2.
    """
    # ASSUME: an excitation that an effect has made negative counts as 0, as negative EMG does.
    u = excitation.clamp(min=0.0)
    small = shape.abs() < 1e-6
    safe = torch.where(small, 1.0, shape)
    return torch.where(small, u, torch.special.expm1(safe * u) / torch.special.expm1(safe))


def straight_path(q: Tensor, *, squares: Tensor, product: Tensor) -> tuple[Tensor, Tensor]:
    """Length [m] and signed moment arm R = -d length / dq [m] of a muscle straight across the hinge.

    Torque is F R, shortening velocity R qdot.

    Args:
        q: elbow angle [rad].
        squares: l1^2 + l2^2 [m^2].
        product: l1 l2 of a flexor, -l1 l2 of an extensor [m^2].

    Source: law of cosines and Eqs. 58-59 for the geometry of Taneja et al. 2023, Fig. 6; the minus sign of Eq. 57 is
    in `product`.
    """
    length = torch.sqrt(squares + 2.0 * product * torch.cos(q))
    return length, product * torch.sin(q) / length


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


def hill_force(curves: Curves, activation: Tensor, length: Tensor, velocity: Tensor) -> Tensor:
    """Fibre force in units of f0: a f_AL(l) f_V(v) + f_P(l).

    Source: Taneja et al. 2023, Eqs. 45-46.
    """
    return activation * curves.active_length(length) * curves.force_velocity(velocity) + curves.passive(length)
