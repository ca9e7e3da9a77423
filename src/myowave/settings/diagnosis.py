"""The section `diagnosis`, and the study of how often it is right."""

from typing import Annotated

from pydantic import Field

from myowave.settings.section import Name, Once, Real, Section, Whole, setting

CONSTANT = r"^[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9_]+)?$"

# Worlds of the study: as the model assumes, and each other in one way; in the last, effects are not in the catalogue.
WORLDS = ("as_assumed", "other_curves", "other_constants", "other_data", "other_solver", "outside")


class Scatter(Section):
    """What is known of a constant that nobody measured on this subject: standard deviation about the model's value."""

    relative: Real = setting("share of the value", "-", 0.0, ge=0, le=1)
    absolute: Real = setting("the same in the constant's unit, added to it", "SI", 0.0, ge=0)


class Study(Section):
    """How often the diagnosis is right: effects hidden in simulated trials, `snakemake hidden_effects`."""

    dataset: Name | None = setting(
        "simulated dataset whose trials the effects are hidden in; null: the first one", default=None
    )
    effects: Annotated[tuple[Name, ...], Once] | None = setting(
        "effects to hide, one at a time; null: all that ship", default=None, min_length=1
    )
    strengths: Annotated[tuple[Annotated[Real, Field(gt=0, le=1)], ...], Once] = setting(
        "strengths of the hidden effects, as fractions of twice the typical one, or of what bounds allow",
        "-",
        (0.25, 0.5, 1.0),
        min_length=1,
    )
    cases: Whole = setting("datasets with an effect, for each world and noise", "-", 26, ge=1, le=100_000)
    clean_sets: Whole = setting("datasets without an effect, for each world", "-", 40, ge=1, le=100_000)
    angle_noises_deg: Annotated[tuple[Real, ...], Once] = setting(
        "noises of the angle in the world that is as assumed", "deg", (0.3, 1.0, 3.0), min_length=1
    )
    angle_noise_deg: Real = setting("noise of the angle in the other worlds", "deg", 1.0, gt=0, le=30)
    parts: Whole = setting("jobs that each world is cut into", "-", 2, ge=1, le=1000)


class Diagnosis(Section):
    """Where the physics is wrong, and what is missing."""

    angle_noise_deg: Real | None = setting(
        "standard deviation of the angle's noise; null: estimated from the training trials", "deg", None, gt=0, le=30
    )
    at_rest: bool = setting("every trial starts at rest, so that its first velocity is not estimated", "", False)
    scatter: dict[Annotated[str, Field(pattern=CONSTANT)], Scatter] = setting(
        "constants that nobody measured, free while effects are weighed, by constant (slack) or by muscle (slack_Bi)",
        default=dict,
        each="constant",
    )
    starts: Whole = setting("searches of the fit of the base model, side by side", "-", 8, ge=1, le=1000)
    study: Study = setting("how often the diagnosis is right", default=Study)
