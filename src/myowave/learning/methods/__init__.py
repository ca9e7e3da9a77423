"""The methods of training, one for each class of recipes.

A method is two entries of this module, a package beside `rollout` and `paper`, and a class of recipes in
`settings.learning`. Its training begins with a stage. `learn(epoch, done, val_mse)` is the next epoch: it moves weights
and parameters, and returns the losses; `epoch` counts from 1 in this scale, `done` is the share of the epochs of all
scales that went before, and `val_mse` (S,) the network's error on the validation windows [rad^2]. Its `parameters` have
`values` (S, P) in SI units; `mse` (S,), how far motion simulated with them misses the training trials [rad^2], infinite
where it diverges and NaN where nobody simulates it; and `uncertainty()`, standard errors (S, P) and correlations
(S, P, P), NaN where they are not known.
"""

from collections.abc import Callable, Mapping

from torch import Tensor

from myowave.learning.identification import Identification
from myowave.learning.methods.paper.joint_identification import JointIdentification
from myowave.learning.methods.paper.training import PaperTraining
from myowave.learning.methods.paper.windowed import run_windowed
from myowave.learning.methods.rollout.rollout import roll_out
from myowave.learning.methods.rollout.training import RolloutTraining
from myowave.learning.network import Network

Parameters = Identification | JointIdentification

TRAININGS: Mapping[str, type[RolloutTraining | PaperTraining]] = {"rollout": RolloutTraining, "paper": PaperTraining}

RUNS: Mapping[str, Callable[[Network, Tensor, Tensor, Tensor], Tensor]] = {"rollout": roll_out, "paper": run_windowed}
"""Free runs of windows: see `prediction.run_free`."""
