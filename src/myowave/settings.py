"""Every setting of config.yaml: its type, bounds, unit and meaning. There is no other schema.

`parse_settings` turns the parsed YAML into frozen objects or says, a line for each problem, which key is wrong, what
was found and what is allowed. `myowave settings` prints the keys as a table. Nothing heavy is imported here: the
Snakefile reads this module at every start.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, field_validator, model_validator

from myowave.schema_keys import did_you_mean, explain, list_keys


def _refuse_bool(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("expected a number; YAML reads yes, no, on and off as true or false")
    return value


def _name_of_trial(value: Any) -> Any:
    """Trials may be called 1, 2, ...: YAML reads those as numbers."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


Real = Annotated[float, BeforeValidator(_refuse_bool)]
Whole = Annotated[int, BeforeValidator(_refuse_bool)]
TrialName = Annotated[str, BeforeValidator(_name_of_trial)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
ModelName = Annotated[str, Field(pattern=r"^base(\+[A-Za-z_][A-Za-z0-9_]*)*$")]


def setting(meaning: str, unit: str = "", default: Any = ..., *, each: str = "name", **bounds: Any) -> Any:
    """A key of the configuration; `each` names what the keys of a mapping stand for."""
    source = {"default_factory": default} if callable(default) else {"default": default}
    return Field(**source, description=meaning, json_schema_extra={"unit": unit, "each": each}, **bounds)


class Section(BaseModel):
    """Frozen, and refuses keys it does not know."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


# ---------------------------------------------------------------------------------------------------- physics


class Muscle(Section):
    """A muscle group that crosses the elbow. Defaults are left to config.yaml: no value is right for any muscle."""

    side: Literal["flexor", "extensor"] = setting("side of the joint on which the muscle runs")
    emg: Annotated[str, Field(pattern=r"^emg_\w+$")] = setting("EMG channel that drives it: a column of the trials")
    f0_N: Real = setting("maximum isometric force", "N", gt=0)
    l0_m: Real = setting("optimal fibre length", "m", gt=0)
    vmax_m_s: Real = setting("maximum contraction velocity", "m/s", gt=0)
    slack_m: Real = setting("tendon slack length", "m", gt=0)
    pennation_rad: Real = setting("pennation angle at optimal fibre length", "rad", 0.0, ge=0, lt=1.4)
    l1_m: Real = setting("distance of the origin from the joint", "m", gt=0)
    l2_m: Real = setting("distance of the insertion from the joint", "m", gt=0)
    delay_s: Real = setting("electromechanical delay", "s", 0.08, ge=0, le=0.5)
    shape_A: Real = setting("shape factor A of the activation, Eq. 2", "-", 0.2, ge=0, le=3)


class Joint(Section):
    """The forearm: a point mass on a rigid rod."""

    mass_kg: Real = setting("forearm mass, at the wrist", "kg", gt=0)
    length_m: Real = setting("forearm length", "m", gt=0)


class Curves(Section):
    """Which published muscle curves to use; their sources are in physics/curves.py."""

    active_length: Literal["taneja", "millard", "degroote"] = setting("active force-length", "", "taneja")
    passive: Literal["taneja", "millard", "degroote"] = setting("passive force-length", "", "taneja")
    force_velocity: Literal["thelen", "millard", "degroote"] = setting("force-velocity", "", "thelen")


class Physics(Section):
    """The musculoskeletal model that everything starts from."""

    muscles: dict[Name, Muscle] = setting("muscle groups, by short name", each="muscle", min_length=1)
    joint: Joint = setting("the forearm")
    curves: Curves = setting("muscle curves", default=Curves)
    effect_files: tuple[str, ...] = setting("Python files with effects of your own", default=())

    @property
    def parameters(self) -> set[str]:
        """Names of all physical constants: `f0_Bi`, ..., `mass`, `length`, `load`."""
        kinds = ("f0", "l0", "vmax", "slack", "pennation", "l1", "l2", "delay", "shape")
        return {f"{kind}_{muscle}" for kind in kinds for muscle in self.muscles} | {"mass", "length", "load"}


# ------------------------------------------------------------------------------------------------------- data


class Identify(Section):
    """A physical constant to identify, and where its search starts."""

    start_spread: Real = setting("starts up to this fraction of the model's value away", "-", 0.2, ge=0, lt=1)
    low: Real | None = setting("lower bound where one is known, SI units", "SI", None)
    high: Real | None = setting("upper bound where one is known, SI units", "SI", None)
    literature: tuple[Real, ...] = setting(
        "values of the literature; the parameter is then a mean of them times sigmoids, Eq. 41 as printed", "SI", ()
    )

    @model_validator(mode="after")
    def _ordered(self) -> "Identify":
        if self.low is not None and self.high is not None and self.low >= self.high:
            raise ValueError(f"low {self.low} must be below high {self.high}")
        if (self.low is None) != (self.high is None):
            raise ValueError("low and high are given together, or neither")
        if self.literature and self.low is not None:
            raise ValueError("literature (Eq. 41 as printed) and low/high (true bounds) exclude each other; keep one")
        if any(value <= 0 for value in self.literature):
            raise ValueError(f"literature {self.literature} must be positive: Eq. 41 reaches from 0 to their mean")
        return self


def _force_and_length() -> dict[str, Identify]:
    return {
        f"{kind}_{muscle}": Identify(start_spread=spread)
        for muscle in ("Bi", "Tri")
        for kind, spread in (("f0", 0.2), ("l0", 0.1))
    }


class _Dataset(Section):
    """What simulated and measured datasets have in common."""

    test: tuple[TrialName, ...] = setting("trials kept for testing; the others train", min_length=1)
    constants: dict[str, Real] = setting("known physical constants of the subject, {name: value}", "SI", dict)
    conditions: dict[TrialName, dict[str, Real]] = setting(
        "known constants that differ between trials, {trial: {name: value}}", "SI", dict, each="trial"
    )
    identify: dict[str, Identify] = setting(
        "physical constants to identify", default=_force_and_length, each="constant", min_length=1
    )


class SimulatedDataset(_Dataset):
    """Trials made by the physics with a random EMG; the truth is known."""

    kind: Literal["simulated"] = setting("simulated: made by the physics")
    trials: Whole = setting("number of trials, named 1, 2, ...", "-", 5, ge=2, le=1000)
    samples: Whole = setting("samples in a trial", "-", 500, ge=50, le=100_000)
    dt_s: Real = setting("time between samples; the paper's beta = dt^2/I = 1e-3", "s", 0.0316227766, gt=0, le=0.1)
    start_rad: Real = setting("elbow angle at the start, at rest", "rad", math.pi / 6, ge=0.1, le=1.7)
    emg_noise: Real = setting("standard deviation of the noise on the driving EMG", "-", 0.1, ge=0, le=1)
    angle_noise_deg: Real = setting("standard deviation of the noise on the measured angle", "deg", 0.0, ge=0, le=30)
    seed: Whole = setting("seed of EMG and noise", "-", 1, ge=0)
    hidden_effect: dict[str, dict[str, Real]] = setting(
        "effects in the data that nothing but simulation and scoring may know, {effect: {parameter: value}}",
        "SI", dict, each="effect",
    )  # fmt: skip

    @model_validator(mode="after")
    def _test_exists(self) -> "SimulatedDataset":
        names = [str(i + 1) for i in range(self.trials)]
        if unknown := [name for name in (*self.test, *self.conditions) if name not in names]:
            raise ValueError(f"no trial named {', '.join(unknown)}; the {self.trials} trials are {', '.join(names)}")
        if not set(names) - set(self.test):
            raise ValueError("every trial is a test trial; leave some to train on")
        return self


class MeasuredDataset(_Dataset):
    """Trials from files, one a trial, named after the file without its ending."""

    kind: Literal["measured"] = setting("measured: read from files")
    files: tuple[str, ...] = setting("CSV or Parquet files, or patterns such as data/me/*.csv", min_length=1)


Dataset = Annotated[SimulatedDataset | MeasuredDataset, Field(discriminator="kind")]


class Wavelet(Section):
    """The projection of the trials on coarser scales."""

    name: Annotated[str, Field(pattern=r"^(db|sym|coif|haar)\d*$")] = setting("orthogonal wavelet", "", "db2")
    decompose: Literal["both", "emg", "angle"] = setting("which signals are coarsened (Sec. 6)", "", "both")
    levels: Whole = setting("how often the samples are coarsened: scales 0, -1, ..., -levels", "-", 4, ge=0, le=8)


class Data(Section):
    """Where trials come from, and how they are seen at coarser scales."""

    wavelet: Wavelet = setting("multi-resolution", default=Wavelet)
    datasets: dict[Name, Dataset] = setting("all datasets, by name", each="dataset", min_length=1)
    subjects: str | None = setting(
        "CSV table of subjects, each row a measured dataset; `subjects` in targets stands for all", default=None
    )


# --------------------------------------------------------------------------------------------------- learning


class Recipe(Section):
    """How a network is trained. To add a choice, add a field here: messages and tables follow by themselves."""

    cell: Literal["gru", "rnn"] = setting("recurrent cell, Eqs. 11-13 and 8-10", "", "gru")
    hidden: Whole = setting("hidden units", "-", 50, ge=1, le=4096)
    hidden_state: Literal["carried", "windowed"] = setting(
        "carried: handed on from sample to sample (Fig. 5); windowed: starts at 0 for every prediction (Eq. 15)",
        "", "carried",
    )  # fmt: skip
    output: Literal["increment", "absolute"] = setting(
        "absolute: the network gives the angle (Eq. 13); increment: what linear extrapolation lacks", "", "increment"
    )
    time_input: bool = setting("whether time t_n is an input beside EMG", "", False)
    history_steps: Whole = setting("past samples of known angle that a prediction starts from", "-", 4, ge=1, le=100)
    history_noise: Real = setting("noise added to the history while training", "rad", 0.0, ge=0, le=1)
    rollout_s: Real = setting("time fed by the network's own predictions; 0 is teacher forcing", "s", 1.6, ge=0, le=60)
    epochs: Whole = setting("epochs of all scales together", "-", 1500, ge=1)
    learning_rate: Real = setting("initial step of Adam", "-", 3e-3, gt=0, le=1)
    schedule: Literal["constant", "cosine"] = setting("how the step changes over all epochs", "", "cosine")
    beta: Real = setting("weight of the physics residual in the network's loss, Eq. 16", "-", 0.0, ge=0)
    derivative: Literal["sequence", "time"] = setting(
        "derivatives in the residual: of the predicted sequence, or of the network by its input t_n", "", "sequence"
    )
    identification: Literal["gauss_newton", "joint"] = setting(
        "gauss_newton: on the weak form of the residual; joint: with the weights, by Adam on J", "", "gauss_newton"
    )
    simulated_trials: Whole = setting(
        "trials simulated with the identified parameters, on EMG that was never recorded, to train on", "-", 64, ge=0
    )
    validation_fraction: Real = setting("share of the training trials kept for early stopping", "-", 0.1, gt=0, lt=0.9)
    patience: Whole = setting("epochs without a better validation error before a scale stops", "-", 300, ge=1)

    @model_validator(mode="after")
    def _consistent(self) -> "Recipe":
        if self.hidden_state == "windowed" and self.rollout_s > 0:
            raise ValueError("rollout_s above 0 needs hidden_state: carried; windowed states are teacher-forced")
        if self.hidden_state == "carried" and self.beta > 0:
            raise ValueError("beta above 0 needs hidden_state: windowed; a carried state has no residual in its loss")
        if self.identification == "joint" and self.beta == 0:
            raise ValueError("identification: joint needs beta above 0: without a residual in J nothing is identified")
        if self.derivative == "time" and not self.time_input:
            raise ValueError("derivative: time needs time_input: true; there is no t_n to differentiate by")
        if self.derivative == "time" and self.output != "absolute":
            raise ValueError("derivative: time needs output: absolute; an increment is no function of t_n alone")
        return self


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
    """`snakemake sweep`: a search for better settings of a recipe, judged on data held out of the training trials."""

    dataset: Name | None = setting("dataset; null: the first of targets.datasets", default=None)
    model: ModelName = setting("physical model", default="base")
    recipe: Name | None = setting("recipe to improve; null: the first of targets.recipes", default=None)
    scales: Annotated[int, Field(ge=1, le=5)] | None = setting(
        "number of scales; null: the most of targets.scales", "-", None
    )
    dimensions: dict[Name, Dimension] = setting(
        "ranges to search, {numeric setting of the recipe: range}; null instead of a range: not searched",
        default=dict, each="setting",
    )  # fmt: skip
    trials: Whole = setting("settings to try; a larger number later goes on from there", "-", 20, ge=1)
    workers: Whole = setting("jobs that search side by side", "-", 2, ge=1, le=1000)
    seeds: Whole = setting("independent starts of each setting; their mean error counts", "-", 2, ge=1, le=1000)
    epochs: Whole | None = setting("epochs of all scales of one start; null: as in the recipe", "-", None, ge=1)
    held_out: Real = setting("share of each training trial, at its end, that judges a setting", "-", 0.25, gt=0, lt=0.9)
    pruner: Literal["median", "none"] = setting(
        "median: give a setting up whose error after a scale is above the median of those before", "", "median"
    )
    unpruned: Whole = setting("settings that are tried to the end before any is given up", "-", 5, ge=1)
    seed: Whole = setting("seed of the search", "-", 0, ge=0)
    storage: str = setting(
        "where the study is: journal, a file beside its results, or postgresql://USER@HOST/DATABASE", "", "journal",
        pattern=r"^(journal|postgresql(\+\w+)?://.+)$",
    )  # fmt: skip

    @field_validator("dimensions", mode="before")
    @classmethod
    def _without_null(cls, value: Any) -> Any:
        """A file laid over another can only replace keys, so null takes one out."""
        return {k: v for k, v in value.items() if v is not None} if isinstance(value, Mapping) else value


class Learning(Section):
    """The surrogate and the identification that comes with it."""

    seeds: Whole = setting("independent starts, trained together", "-", 5, ge=1, le=1000)
    recipes: dict[Name, Recipe] = setting("ways to train, by name", each="recipe", min_length=1)
    sweep: Sweep = setting("search for better settings of a recipe", default=Sweep)


# ------------------------------------------------------------------------------------------- diagnosis, tracking


class Study(Section):
    """How often the diagnosis is right: effects hidden in simulated trials, `snakemake hidden_effects`."""

    dataset: Name = setting("simulated dataset whose trials the effects are hidden in", "", "case1")
    effects: tuple[Name, ...] = setting("effects to hide, one at a time", default=("joint_damping",), min_length=1)
    strengths: tuple[Real, ...] = setting(
        "strengths of the hidden effects, as fractions of twice the typical one, or of what bounds allow", "-",
        (0.25, 0.5, 1.0), min_length=1,
    )  # fmt: skip
    seeds: Whole = setting("datasets for each effect and strength", "-", 3, ge=1, le=100)
    angle_noises_deg: tuple[Real, ...] = setting("noises of the angle", "deg", (0.3, 1.0, 3.0), min_length=1)
    clean_sets: Whole = setting("datasets without an effect for each noise", "-", 20, ge=1, le=1000)
    pairs: tuple[tuple[Name, Name], ...] = setting("effects hidden together", "", ())


class Diagnosis(Section):
    """Where the physics is wrong, and what is missing."""

    angle_noise_deg: Real | None = setting(
        "standard deviation of the angle's noise; null: estimated from the trials", "deg", None, gt=0, le=30
    )
    at_rest: bool = setting("every trial starts at rest, so that its first velocity is not estimated", "", False)
    starts: Whole = setting("searches of the fit of the base model, side by side", "-", 8, ge=1, le=1000)
    study: Study = setting("how often the diagnosis is right", default=Study)


class Tracking(Section):
    """Where MLflow shows the results; they are on disk with or without it."""

    uri: str = setting(
        "MLflow store: sqlite:///FILE, or the http(s) address of a server", "", "sqlite:///results/mlflow.db",
        pattern=r"^(sqlite:///|postgresql\S*://|https?://).+",
    )  # fmt: skip


class Targets(Section):
    """What plain `snakemake` makes. It changes no result, only which ones there are."""

    datasets: tuple[str, ...] = setting("datasets", min_length=1)
    models: dict[str, tuple[ModelName, ...]] = setting(
        "physical models by dataset, such as base+joint_damping; [base] for one not named", default=dict, each="dataset"
    )
    follow_verdict: tuple[str, ...] = setting(
        "datasets whose network is also trained with the physical model that the diagnosis finds", default=()
    )
    recipes: tuple[str, ...] = setting("recipes", default=("rollout",), min_length=1)
    scales: tuple[Annotated[int, Field(ge=1, le=5)], ...] = setting(
        "numbers of scales, 1 to 5: 3 trains at scales -2, -1, 0", "-", (1, 2, 3), min_length=1
    )


class Settings(Section):
    """All of config.yaml."""

    targets: Targets = setting("what plain `snakemake` makes")
    physics: Physics = setting("the musculoskeletal model")
    data: Data = setting("trials and scales")
    learning: Learning = setting("training")
    diagnosis: Diagnosis = setting("diagnosis", default=Diagnosis)
    tracking: Tracking = setting("MLflow", default=Tracking)

    @model_validator(mode="after")
    def _names_exist(self) -> "Settings":
        problems = []
        for i, name in enumerate(self.targets.datasets):
            problems += _unless_known(f"targets.datasets[{i}]", name, self.data.datasets)
        for i, name in enumerate(self.targets.follow_verdict):
            problems += _unless_known(f"targets.follow_verdict[{i}]", name, self.data.datasets)
        for name in self.targets.models:
            problems += _unless_known(f"targets.models.{name}", name, self.data.datasets)
        for i, name in enumerate(self.targets.recipes):
            problems += _unless_known(f"targets.recipes[{i}]", name, self.learning.recipes)
        if (scales := max(*self.targets.scales, self.learning.sweep.scales or 1)) > self.data.wavelet.levels + 1:
            problems.append(
                f"targets.scales, learning.sweep.scales: {scales} scales need data.wavelet.levels of {scales - 1}, "
                f"which is {self.data.wavelet.levels}."
            )
        problems += self._problems_of_sweep()
        for name, dataset in self.data.datasets.items():
            where = f"data.datasets.{name}"
            named = [(f"{where}.identify.{p}", p) for p in dataset.identify]
            named += [(f"{where}.constants.{p}", p) for p in dataset.constants]
            named += [(f"{where}.conditions.{t}.{p}", p) for t, c in dataset.conditions.items() for p in c]
            for path, parameter in named:
                if "." not in parameter:  # a parameter of an effect is checked where effects are known
                    problems += _unless_known(path, parameter, self.physics.parameters)
            for parameter in set(dataset.identify) & set(dataset.constants):
                problems.append(f"{where}: {parameter} is both known (constants) and to identify; keep one of them.")
        if problems:
            raise ValueError("\n".join(problems))
        return self

    def sweep(self) -> Sweep:
        """The section learning.sweep, what is null in it filled in from the targets."""
        sweep, targets = self.learning.sweep, self.targets
        return sweep.model_copy(
            update={
                "dataset": sweep.dataset or targets.datasets[0],
                "recipe": sweep.recipe or targets.recipes[0],
                "scales": sweep.scales or max(targets.scales),
            }
        )

    def _problems_of_sweep(self) -> list[str]:
        sweep = self.sweep()
        problems = _unless_known("learning.sweep.dataset", sweep.dataset, self.data.datasets)
        problems += _unless_known("learning.sweep.recipe", sweep.recipe, self.learning.recipes)
        if problems:
            return problems
        recipe = dump(self.learning.recipes[sweep.recipe])
        numeric = [name for name, field in Recipe.model_fields.items() if field.annotation in (int, float)]
        for name, dimension in sweep.dimensions.items():
            where = f"learning.sweep.dimensions.{name}"
            if unknown := _unless_known(where, name, numeric):
                problems += unknown
                continue
            for end, value in (("low", dimension.low), ("high", dimension.high)):
                try:
                    Recipe.model_validate(recipe | {name: int(value) if value.is_integer() else value})
                except ValidationError as error:
                    lines = explain(error, tuple(list_keys(Recipe)))
                    problems += [f"{where}.{end} does not fit recipe {sweep.recipe}: {line}" for line in lines]
        return problems


def _unless_known(path: str, name: str, known: Any) -> list[str]:
    if name in known:
        return []
    names = sorted(known)
    return [f"{path}: there is no {name!r}{did_you_mean(name, names)} Known: {', '.join(names)}."]


KEYS = tuple(list_keys(Settings))


def parse_settings(config: Mapping[str, Any]) -> Settings:
    """Check a parsed config.yaml.

    Raises:
        ValueError: one line a problem, each with the key, what was found and what is allowed.
    """
    return _parse(Settings, config, ())


def parse_section(path: str, values: Mapping[str, Any]) -> Any:
    """The settings object for one part of the configuration, such as `physics` or `learning.recipes.rollout`.

    Args:
        path: dotted path of the part.
        values: the part, as `dump` gives it.
    """
    parts = tuple(path.split("."))
    kinds = {1: _SECTIONS, 3: {"datasets": MeasuredDataset, "recipes": Recipe}}[len(parts)]
    kind = kinds[parts[0] if len(parts) == 1 else parts[1]]
    if kind is MeasuredDataset and values.get("kind") == "simulated":
        kind = SimulatedDataset
    return _parse(kind, values, parts)


def check_effects(settings: Settings) -> None:
    """Whether the effects that the settings name are there, told from file names: loading the physics takes a second.

    With effect files of the user's own, whose names are known only once they are loaded, a job finds out instead.

    Raises:
        ValueError: one line for each effect that is not there.
    """
    if settings.physics.effect_files:
        return
    folder = Path(__file__).parent / "physics" / "effects"
    known = [path.stem for path in folder.glob("[!_]*.py")]
    named = [
        (f"targets.models.{dataset}", effect)
        for dataset, models in settings.targets.models.items()
        for model in models
        for effect in model.split("+")[1:]
    ]
    for name, dataset in settings.data.datasets.items():
        named += [(f"data.datasets.{name}.hidden_effect", effect) for effect in getattr(dataset, "hidden_effect", ())]
    if problems := [line for path, effect in named for line in _unless_known(path, effect, known)]:
        raise ValueError("\n".join(problems))


_SECTIONS = {name: field.annotation for name, field in Settings.model_fields.items()}


def dump(section: Section) -> dict[str, Any]:
    """A section as plain data, defaults filled in: what a rule is given, and what its result depends on."""
    return section.model_dump(mode="json")


def public(dataset: SimulatedDataset | MeasuredDataset) -> dict[str, Any]:
    """A dataset as plain data without what is hidden in it: all that a rule may know but simulation and scoring."""
    values = dump(dataset)
    values.pop("hidden_effect", None)
    return values


def _parse(kind: type[Section], values: Mapping[str, Any], path: tuple[str, ...]) -> Any:
    try:
        return kind.model_validate(values)
    except ValidationError as error:
        lines = explain(error, KEYS if not path else tuple(list_keys(kind)))
        prefix = ".".join(path) + "." if path else ""
        raise ValueError("\n".join(prefix + line for line in lines)) from None
