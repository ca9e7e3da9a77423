"""The methods of training, one for each class of recipes.

A method is an entry of this module, a package beside `rollout` and `paper`, and a class of recipes in
`settings.learning`. Its training begins with a stage. `learn(epoch, done, val_mse)` is the next epoch: it moves weights
and parameters, and returns the losses; `epoch` counts from 1 in this scale, `done` is the share of the epochs of all
scales that went before, and `val_mse` (S,) the network's error on the validation windows [rad^2]. Its `parameters` have
`values` (S, P) in SI units, and `judge()`, None where nobody knows, gives their standard errors (S, P), how they are
correlated (S, P, P), and how far motion simulated with them misses the training trials (S,) [rad^2].
"""

from collections.abc import Mapping

from myowave.learning.identification import Identification
from myowave.learning.methods.paper.joint_identification import JointIdentification
from myowave.learning.methods.paper.training import PaperTraining
from myowave.learning.methods.rollout.training import RolloutTraining

Parameters = Identification | JointIdentification

TRAININGS: Mapping[str, type[RolloutTraining | PaperTraining]] = {"rollout": RolloutTraining, "paper": PaperTraining}
