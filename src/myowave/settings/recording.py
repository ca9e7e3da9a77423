"""Raw recordings within the section `data`: where each signal is, and how EMG is processed."""

import fnmatch
import os
import re
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from myowave.settings.section import NOT_PLAIN, PLAIN, Real, Section, TrialName, Whole, matching, setting

_ONE_OR_MORE = BeforeValidator(lambda value: [value] if isinstance(value, str) else value)
Format = Literal["csv", "parquet", "noraxon", "delsys", "vicon", "opensim", "matlab", "c3d", "edf"]
TRIAL = "{trial}"
_ONE_PLACEHOLDER = matching(
    r"(?s)([^{}]|\{trial\})*", f"the only placeholder is {TRIAL}, which stands for the name of a trial"
)
ChannelName = Annotated[str, matching(r"emg_\w+", "EMG channels are called emg_<muscle>, such as emg_biceps")]
RecordingName = Annotated[
    str, Field(coerce_numbers_to_str=True), matching(rf"{PLAIN}(/{PLAIN})*", NOT_PLAIN.replace(" /", ""))
]
_A_DAY: dict[str, Any] = {"ge": -86_400, "le": 86_400}  # of two clocks one may tell the time of day
EmgStartOffset = Annotated[Real, Field(**_A_DAY, json_schema_extra={"bounds": _A_DAY})]
ExtraName = Annotated[str, matching(r"[a-z]\w*_rad", "further angles have names that end in _rad, such as tilt_rad")]


class RawSignal(Section):
    file: Annotated[str, _ONE_PLACEHOLDER] = setting(
        "file that holds it; {trial} stands for the name of the trial, and * for anything that matches one file"
    )
    column: str | None = setting("its name in the file; null where the file holds one signal", default=None)
    format: Format | None = setting("format of the file; null goes by the ending", default=None)
    unit: str | None = setting("unit, where the file names none", default=None)
    rate_hz: Real | None = setting("samples a second, where the file does not tell", "Hz", None, ge=10, le=50_000)

    def trial_of(self, path: Path) -> str | None:
        """The trial for which `file` stands for this one; None where it never does."""
        written = fnmatch.translate(os.path.abspath(self.file)).replace(re.escape(TRIAL), "(?P<trial>[^/]+)", 1)
        match = re.match(written.replace(re.escape(TRIAL), "(?P=trial)"), os.path.abspath(path))
        return match and match["trial"]


class EmgChannel(RawSignal):
    form: Literal["raw", "envelope", "fraction"] = setting(
        "raw: as the electrodes saw it; envelope: rectified and smoothed; fraction: of a maximum contraction", "", "raw"
    )


class Signed(Section):
    sign: Literal[1, -1] = setting("1, or -1 where the recorder counts the other way round", default=1)


class TurnedAngle(Signed):
    """An angle as it counts here: sign * value + offset."""

    offset_deg: Real = setting("added after the sign, so that 0 hangs straight down", "deg", 0.0, ge=-360, le=360)


class RawAngle(TurnedAngle, RawSignal):
    """An angle as recorded."""


class ExtraAngle(RawAngle):
    """A further angle over time, such as the tilt of the upper arm."""

    condition: str | None = setting(
        "physical constant whose known value is its median over a trial, such as tilt; null for none", default=None
    )


class RawTorque(Signed, RawSignal):
    """Torque as a dynamometer recorded it: sign * value, in N m (Ncm or Nmm where `unit` or the file says so)."""

    trials: tuple[TrialName, ...] | None = setting("trials in which it was measured; null: all", default=None)


class RawMotor(Signed, RawSignal):
    """Known torque of a motor on the joint: sign * value in N m, or that of a direct-current motor from its duty."""

    volts: str | None = setting(
        "column of the supply's voltage; `column` is then the share of it on the motor, -1 to 1, and torque is kt / R "
        "(duty volts - kt speed)",
        default=None,
    )
    kt_Nm_A: Real | None = setting("torque constant kt, gears counted", "N m/A", None, gt=0)
    resistance_ohm: Real | None = setting("of the windings, R", "ohm", None, gt=0)

    @model_validator(mode="after")
    def _all_or_none(self) -> "RawMotor":
        given = [x is not None for x in (self.volts, self.kt_Nm_A, self.resistance_ohm)]
        if any(given) != all(given):
            raise ValueError("give volts, kt_Nm_A and resistance_ohm together, or none where torque was recorded")
        return self


class RawKeep(RawSignal):
    """Which part of a recording to keep: the longest in which a column has a value."""

    equals: Real = setting("this value, in the unit of the file, such as 0 for a motor that is off", "-")


class TextLayout(Section):
    """How tables of text are written; null is told from the file."""

    separator: Literal["comma", "semicolon", "tab", "space"] | None = setting("between columns", default=None)
    decimal: Literal["point", "comma"] | None = setting("decimal sign", default=None)
    header_row: Whole | None = setting("row with the names of columns, counted from 1", "-", None, ge=1, le=10_000)
    time_column: Annotated[tuple[str, ...], _ONE_OR_MORE] | None = setting(
        "column of times, or [several] of which each file has one; null takes time, t, Zeit or the first in s or ms",
        default=None,
    )
    time_unit: Literal["ms", "sample"] | None = setting(
        "ms where times are in ms that the file does not tell; sample where they count samples: rate_hz is the rate",
        default=None,
    )
    resample_hz: Real | None = setting(
        "rate that uneven times are brought to, on straight lines; null refuses them", "Hz", None, ge=10, le=50_000
    )


class Processing(Section):
    """From raw EMG to the excitation, and onto a common grid of samples."""

    band_pass_hz: tuple[Real, Real] | None = setting(
        "band of the raw EMG that is kept; its upper end is at most 0.45 of the sampling rate", "Hz", (20.0, 450.0)
    )
    notch_hz: Real | None = setting("mains hum to take out where a line is found", "Hz", None, gt=0, le=1000)
    low_pass_hz: Real = setting("corner of the envelope of the rectified EMG", "Hz", 4.0, gt=0, le=50)
    phase: Literal["zero", "causal"] = setting(
        "zero: filtered forwards and backwards, no lag; causal: as in real time, with the filter's lag", default="zero"
    )
    rate_hz: Real | None = setting("samples a second of the trials; null takes the angle's", "Hz", None, ge=10, le=2500)
    emg_start_offset_s: Real = setting(
        "time by which the EMG's clock started after the angle's; negative: before", "s", 0.0, **_A_DAY
    )

    @model_validator(mode="after")
    def _band_in_order(self) -> "Processing":
        if self.band_pass_hz is not None and not 0 < self.band_pass_hz[0] < self.band_pass_hz[1]:
            raise ValueError(f"band_pass_hz {list(self.band_pass_hz)}: expected two frequencies, the lower one first")
        if self.rate_hz is not None and self.low_pass_hz > 0.4 * self.rate_hz:
            raise ValueError(
                f"low_pass_hz {self.low_pass_hz:g} cannot be told apart at rate_hz {self.rate_hz:g}; expected at most "
                "0.4 of the rate"
            )
        return self
