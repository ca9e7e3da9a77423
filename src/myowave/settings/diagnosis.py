"""The section `diagnosis`."""

from myowave.settings.section import Name, Real, Section, Whole, setting


class Scatter(Section):
    """What is known of a constant that nobody measured on this subject: standard deviation about the model's value."""

    relative: Real = setting("share of the value", "-", 0.0, ge=0, le=1)
    absolute: Real = setting("the same in the constant's unit, added to it", "SI", 0.0, ge=0)


class DiagnosisSettings(Section):
    """Where the physics is wrong, and what is missing."""

    angle_noise_deg: Real | None = setting(
        "standard deviation of the angle's noise; null: estimated from the training trials", "deg", None, gt=0, le=30
    )
    scatter: dict[Name, Scatter] = setting(
        "constants that nobody measured, which stay free, as slack, or slack_Bi of a muscle", "", dict, each="constant"
    )
    starts: Whole = setting("searches of the fit of the base model, side by side", "-", 8, ge=1, le=1000)
