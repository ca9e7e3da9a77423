"""Contraction of both sides that was not recorded: deeper heads work against one another, and the joint stiffens."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter
from myowave.physics.muscle import mean_of_antagonists


def with_both_sides(excitation: Tensor, side: Tensor, *, c: Tensor) -> Tensor:
    """Excitation u_i + c mean(u_j) over the antagonists j of muscle i: what works against it pulls it along."""
    # ASSUME: what the electrodes miss is a fixed share of the antagonists' excitation, at the same time.
    return excitation + c * mean_of_antagonists(excitation, side)


EFFECT = Effect(
    name="co_contraction",
    title="co-contraction that was not recorded",
    acts_on="excitation",
    equation="u_i + c mean(u_antagonists)",
    function=with_both_sides,
    parameters={
        "c": Parameter("-", high=1.0, typical=0.1, meaning="share of the antagonists that a muscle joins unseen")
    },
    source="co-activation about the elbow, e.g. Gribble, Mullin, Cothros & Mattar 2003, J. Neurophysiol. 89",
)
