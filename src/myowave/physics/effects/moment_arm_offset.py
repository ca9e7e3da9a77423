"""Moment arms that are off by a constant: a misplaced joint centre or insertion."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def shifted_path(length_mt: Tensor, moment_arm: Tensor, q: Tensor, side: Tensor, *, d: Tensor) -> tuple[Tensor, Tensor]:
    """Length and signed moment arm [m] with the arm longer by d; the length changes by as much as virtual work asks.

    -d length / dq is still the moment arm, so the muscle does the work that the joint receives.
    """
    return length_mt - side * d * q, moment_arm + side * d


EFFECT = Effect(
    name="moment_arm_offset",
    title="moment arms off by a constant",
    acts_on="path",
    equation="R + d, length - d q (flexors; extensors mirrored)",
    function=shifted_path,
    parameters={
        "d": Parameter(
            "m", low=-0.05, high=0.05, typical=0.01, meaning="how much longer a moment arm is", each="muscle"
        )
    },
    source="virtual work, R = -d length / dq; An et al. 1984, J. Biomech. Eng. 106",
)
