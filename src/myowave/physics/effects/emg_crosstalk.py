"""Crosstalk: electrodes pick up the muscles on the other side of the arm."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter
from myowave.physics.muscle import mean_of_antagonists


def without_crosstalk(excitation: Tensor, side: Tensor, *, x: Tensor) -> Tensor:
    """Excitation u_i - x mean(u_j) over the antagonists j of muscle i: the recording less what is not the muscle's own.

    To first order in x this undoes a recording e_i = u_i + x mean(u_j).
    """
    # ASSUME: the same share from each antagonist, at once and unfiltered; none from synergists.
    return excitation - x * mean_of_antagonists(excitation, side)


EFFECT = Effect(
    name="emg_crosstalk",
    title="crosstalk between electrodes",
    acts_on="excitation",
    equation="u_i - x mean(u_antagonists)",
    function=without_crosstalk,
    parameters={"x": Parameter("-", high=0.5, typical=0.1, meaning="share of the antagonists in each muscle's EMG")},
    source="De Luca & Merletti 1988, Electroencephalogr. Clin. Neurophysiol. 69: up to 17 % between neighbours",
)
