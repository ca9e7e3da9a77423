"""The section `learning`: recipes, and the sweep that improves one."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from myowave.physics.constants import JOINT_CONSTANTS, is_constant
from myowave.settings.keys import did_you_mean
from myowave.settings.section import (
    ModelName,
    Name,
    Once,
    Real,
    Section,
    Whole,
    setting,
    without_null,
)


class Recipe(Section):
    """How a network is trained. To add a choice, add a field here: messages and tables follow by themselves."""

    cell: Literal["gru", "rnn"] = setting("recurrent cell, Eqs. 11-13 and 8-10", "", "gru")
    hidden: Whole = setting("hidden units", "-", 50, ge=1, le=4096)
    hidden_state: Literal["carried", "windowed"] = setting(
        "carried: handed on from sample to sample (Fig. 5); windowed: starts at 0 for every prediction (Eq. 15)",
        "",
        "carried",
    )
    output: Literal["increment", "absolute"] = setting(
        "absolute: the network gives the angle (Eq. 13); increment: what linear extrapolation lacks", "", "increment"
    )
    time_input: bool = setting("whether time t_n is an input beside EMG", "", False)
    known_inputs: Annotated[tuple[str, ...], Once] | None = setting(
        "inputs beside EMG: names of conditions such as load, where they differ between training trials, and of "
        "signals such as tilt_rad, of which a dataset may have any; null: all that it has",
        default=None,
    )
    rate_hz: Real | None = setting(
        "about how many samples a second the network sees, of trials that have more; null: all",
        "Hz",
        None,
        gt=0,
        le=2500,
    )
    history_steps: Whole = setting("past samples of known angle that a prediction starts from", "-", 4, ge=1, le=100)
    history_noise: Real = setting("noise added to the history while training", "rad", 0.0, ge=0, le=1)
    rollout_s: Real = setting("time fed by the network's own predictions; 0 is teacher forcing", "s", 1.6, ge=0, le=60)
    epochs: Whole = setting("epochs of all scales together", "-", 1500, ge=1)
    optimiser: Literal["adam", "soap"] = setting(
        "what moves the weights: adam, Adam; soap, Adam in the basis where a layer's gradient is least correlated",
        "",
        "adam",
    )
    learning_rate: Real = setting("initial step of the optimiser", "-", 3e-3, gt=0, le=1)
    schedule: Literal["constant", "cosine"] = setting("how the step changes over all epochs", "", "cosine")
    beta: Real = setting("weight of the physics residual in the network's loss, Eq. 16", "-", 0.0, ge=0)
    derivative: Literal["sequence", "history", "measured", "time"] = setting(
        "derivatives in the residual: of the predicted sequence, of a prediction after its measured history, of the "
        "measured sequence, or of the network by its input t_n",
        "",
        "sequence",
    )
    residual_angle: Literal["predicted", "measured", "split"] = setting(
        "angles along which the residual takes the torque; split: predicted ones teach the weights, measured ones, "
        "derivatives too, the parameters",
        "",
        "predicted",
    )
    residual_torque: Literal["sampled", "averaged"] = setting(
        "torque in the residual: at the samples, or its mean over the kernel of the second difference", "", "sampled"
    )
    residual_emg: Literal["projected", "recorded"] = setting(
        "EMG in the residual of a coarse scale: projected as the network's, or as recorded", "", "projected"
    )
    tie_vmax: bool = setting("whether v_max changes with an identified l0, as v_max / l0 of the model", "", False)
    parameter_pace: Real = setting(
        "size of Adam's step for parameters identified jointly, times that for the weights", "-", 1.0, gt=0, le=1000
    )
    batches: Whole = setting(
        "steps of the optimiser in an epoch, each on random pieces of the trials; 1: on all", "-", 1, ge=1
    )
    epochs_are: Literal["shared", "each"] = setting(
        "epochs: shared by the scales, or as many for each of them", "", "shared"
    )
    moments: Literal["reset", "kept"] = setting("what the optimiser remembers, at a finer scale", "", "reset")
    emg_input: Literal["recorded", "delayed"] = setting(
        "EMG that the network sees: e(t), or the excitation u(t) = e(t - d), Eq. 1", "", "recorded"
    )
    identification: Literal["gauss_newton", "joint", "none"] = setting(
        "gauss_newton: on the weak form of the residual; joint: with the weights, by Adam on J; none: parameters stay",
        "",
        "gauss_newton",
    )
    simulated_trials: Whole = setting(
        "trials simulated with the identified parameters, on EMG that was never recorded, to train on", "-", 64, ge=0
    )
    emg_gain: Real = setting(
        "training windows of recorded trials are seen with EMG times e^(this times a standard normal), drawn for each "
        "channel, as electrodes, skin and a maximum that nobody measured change it",
        "-",
        0.0,
        ge=0,
        le=1,
    )
    known_noise: Real = setting(
        "the same windows are told what is known beside EMG with this noise, one value for a window, in units of its "
        "standard deviation over the training trials (of the elbow's for angles): few trials are else told apart by it",
        "-",
        0.0,
        ge=0,
        le=10,
    )
    validation_fraction: Real = setting(
        "share of the training trials kept for early stopping, which only the identification sees; 0: they all train, "
        "to the last epoch",
        "-",
        0.1,
        ge=0,
        lt=0.9,
    )
    patience: Whole = setting("epochs without a better validation error before a scale stops", "-", 300, ge=1)

    band: Literal["ends", "trials", "none"] = setting(
        "the 90 % band about predictions is made of errors on: ends, what was kept for validation; trials, each "
        "training trial in turn, by networks that are trained without it; none: no band",
        "",
        "ends",
    )

    @field_validator("known_inputs")
    @classmethod
    def _can_be_known(cls, names: tuple[str, ...] | None) -> tuple[str, ...] | None:
        for name in names or ():
            if not name.endswith("_rad") and not is_constant(name):
                joint = tuple(JOINT_CONSTANTS)
                raise ValueError(
                    f"{name!r} is neither a physical constant{did_you_mean(name, joint)} nor an angle over time such "
                    f"as tilt_rad. Constants of the joint: {', '.join(joint)}"
                )
        return names

    @model_validator(mode="after")
    def _consistent(self) -> "Recipe":
        if self.hidden_state == "windowed" and self.rollout_s > 0:
            raise ValueError("rollout_s above 0 needs hidden_state: carried; windowed states are teacher-forced")
        if self.hidden_state == "carried" and self.beta > 0:
            self._can_teach_rollouts()
        if self.hidden_state == "windowed" and self.simulated_trials > 0:
            raise ValueError(
                "simulated_trials above 0 needs hidden_state: carried; only rollouts learn from simulation"
            )
        if self.hidden_state == "windowed" and max(self.emg_gain, self.known_noise) > 0:
            raise ValueError(
                "emg_gain or known_noise above 0 needs hidden_state: carried; teacher forcing sees trials as recorded"
            )
        if self.identification == "joint" and self.hidden_state == "carried":
            raise ValueError("identification: joint needs hidden_state: windowed; rollouts identify by gauss_newton")
        if self.identification == "joint" and self.beta == 0:
            raise ValueError("identification: joint needs beta above 0: without a residual in J nothing is identified")
        if self.identification == "joint" and self.optimiser == "soap":
            raise ValueError("identification: joint needs optimiser: adam; parameters are no layer with a basis")
        if self.hidden_state == "carried" and self.batches > 1:
            raise ValueError("batches above 1 needs hidden_state: windowed; an epoch of rollouts draws its own windows")
        if self.derivative in ("measured", "history") and self.beta == 0:
            raise ValueError(f"derivative: {self.derivative} needs beta above 0; without it there is no residual")
        if self.derivative == "time" and self.residual_torque == "averaged":
            raise ValueError(
                "residual_torque: averaged needs derivative: sequence, history or measured; a derivative by t_n is no "
                "difference with a kernel to average over"
            )
        if self.identification == "none" and self.simulated_trials > 0:
            raise ValueError(
                "simulated_trials above 0 needs identification: gauss_newton; nothing else finds what they need"
            )
        if self.band == "ends" and self.validation_fraction == 0:
            raise ValueError("band: ends needs validation_fraction above 0; without it, choose trials or none")
        if self.tie_vmax and self.identification != "joint":
            raise ValueError("tie_vmax: true needs identification: joint; a search does not tie parameters")
        if self.derivative == "time" and not self.time_input:
            raise ValueError("derivative: time needs time_input: true; there is no t_n to differentiate by")
        if self.derivative == "time" and self.output != "absolute":
            raise ValueError("derivative: time needs output: absolute; an increment is not a function of t_n only")
        return self

    def changed(self, changes: Mapping[str, Any]) -> "Recipe":
        """The recipe with some settings replaced, checked like any other."""
        return Recipe.model_validate(self.model_dump() | dict(changes))

    def _can_teach_rollouts(self) -> None:
        """Whether the residual can be taken along rollouts."""
        for name, choice, reason in (
            ("identification", "gauss_newton", "nothing else finds the parameters of a residual along rollouts"),
            ("derivative", "sequence", "a rollout is a sequence that no measured angle interrupts"),
            ("residual_angle", "predicted", "a rollout leaves the measured motion, so its torque is not that of it"),
        ):
            if getattr(self, name) != choice:
                raise ValueError(f"beta above 0 with hidden_state: carried needs {name}: {choice}; {reason}")


SEARCHABLE = {name: field.annotation for name, field in Recipe.model_fields.items() if field.annotation in (int, float)}


class Dimension(Section):
    """The range in which a sweep looks for a setting."""

    low: Real = setting("lowest value to try", "as the setting")
    high: Real = setting("highest value to try", "as the setting")
    log: bool = setting("whether to search in the logarithm", default=False)

    @model_validator(mode="after")
    def _ordered(self) -> "Dimension":
        if self.low >= self.high:
            raise ValueError(f"low {self.low:g} must be below high {self.high:g}")
        if self.log and self.low <= 0:
            raise ValueError(f"low is {self.low:g}; a search in the logarithm needs more than 0")
        return self


class Sweep(Section):
    """`snakemake sweep`: a search for better settings of a recipe, judged on each training trial in turn."""

    dataset: Name = setting("dataset")
    model: ModelName = setting("physical model", default="base")
    recipe: Name = setting("recipe to improve")
    scales: Annotated[int, Field(ge=1, le=5)] = setting("number of scales", "-", 1)
    dimensions: dict[Name, Dimension] = setting(
        "ranges to search, {numeric setting of the recipe: range}; null instead of a range: not searched",
        each="setting",
        min_length=1,
    )
    trials: Whole = setting("settings to try; a larger number later goes on from there", "-", 20, ge=1)
    workers: Whole = setting("jobs that search side by side", "-", 2, ge=1, le=1000)
    seeds: Whole = setting("independent starts of each setting; their mean error counts", "-", 2, ge=1, le=1000)
    epochs: Whole | None = setting("epochs of all scales of one start; null: as in the recipe", "-", None, ge=1)

    @field_validator("dimensions", mode="before")
    @classmethod
    def _without_null(cls, value: Any) -> Any:
        """A file laid over another can only replace keys, so null takes one out."""
        return without_null(value)


class Learning(Section):
    """The surrogate and the identification that comes with it."""

    seeds: Whole = setting("independent starts, trained together", "-", 5, ge=1, le=1000)
    recipes: dict[Name, Recipe] = setting("ways to train, by name", each="recipe", min_length=1)
    sweep: Sweep = setting("search for better settings of a recipe")
