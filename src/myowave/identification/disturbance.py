"""What pushes of a fit's motion add to its state: by more excitation, or by any effect.

Shapes: T trials, N samples, K numbers of the state, M muscles, P parameters.
"""

from dataclasses import replace

import numpy as np

from myowave.data.trials import Array
from myowave.identification.output_error import Fit
from myowave.physics.effect import Effect
from myowave.physics.effects.emg_offset import EFFECT as EMG_OFFSET
from myowave.physics.tangent import forcing_of

REACH = 1e-4  # step of the differences


def excitation_forcing(fit: Fit) -> Array:
    """What 1 more in each muscle's excitation adds to the state within a step, (T, N - 1, K, M)."""
    return -forcing_by(fit, EMG_OFFSET, -REACH)  # an offset takes away


def forcing_by(fit: Fit, effect: Effect, reach: float = REACH) -> Array:
    """What 1 in each parameter of an effect adds to the state within a step of a fit's motion, (T, N - 1, K, P).

    Args:
        effect: without a state; the model may have it already. One that the model refuses adds nothing, P = 0.
        reach: step of the differences.
    """
    if fit.model.refuses(effect):
        return np.zeros((*fit.linear.after.shape, 0))
    probe = replace(effect, name=f"{effect.name}_more")
    model = fit.model.with_effects([probe])
    simulation = fit.record.simulation(model, fit.params)
    return forcing_of(simulation, fit.linear, dict.fromkeys(model.parameters_of(probe), 1.0), reach).numpy()
