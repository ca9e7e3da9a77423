"""Whether a file has the columns of a trial: `time_s, emg_<muscle>..., angle_rad` (or `angle_deg`),
and `torque_Nm` where a dynamometer was there."""

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase

from myowave.data.readers import RawRecording
from myowave.data.trials import EMG_PREFIX, TORQUE
from myowave.settings.keys import did_you_mean

TIME, ANGLES = "time_s", ("angle_rad", "angle_deg")


def column_problems(
    recording: RawRecording, channels: Sequence[str] | None, ignored: Sequence[str] = ()
) -> Iterator[str]:
    """Columns that are missing, unknown or there twice.

    Args:
        recording: of one file.
        channels: the EMG columns there must be; None takes whichever there are.
        ignored: names of columns that are not needed; * stands for anything.
    """
    where, header = f"{recording.path}, header", recording.header
    repeated = sorted({name for name in header if header.count(name) > 1 and not is_ignored(name, ignored)})
    if repeated:
        yield f"{where}: columns {', '.join(repeated)} appear more than once; keep one of each."
    emg = tuple(channels or dict.fromkeys(emg_columns(header, ignored)))
    known = (TIME, *emg, *ANGLES, TORQUE)
    extra = [name for name in dict.fromkeys(header) if name not in known and not is_ignored(name, ignored)]
    missing = [name for name in (TIME, *emg) if name not in header]
    if not emg:
        yield f"{where}: no EMG column among {', '.join(header)}; expected emg_<muscle>, such as emg_biceps."
    for name in missing:
        yield f"{where}: column {name} is missing; found {', '.join(header)}."
    angles = [name for name in ANGLES if name in header]
    if len(angles) != 1:
        yield f"{where}: found {' and '.join(angles) or 'no angle'}; expected either angle_rad or angle_deg."
    for name in extra:
        hint = did_you_mean(name, known) or "."
        remedy = "Remove the column" + (
            ", or add a muscle that it drives to physics.muscles."
            if name.startswith(EMG_PREFIX)
            else ", rename it, or name it under ignore_columns."
        )
        yield f"{where}: unknown column {name!r}{hint} Expected {', '.join((TIME, *emg, 'angle_rad'))}. {remedy}"


def emg_columns(header: Sequence[str], ignored: Sequence[str] = ()) -> tuple[str, ...]:
    """The names that say they are EMG, in the order of the file, those left out that are to be ignored."""
    return tuple(name for name in header if name.startswith(EMG_PREFIX) and not is_ignored(name, ignored))


def is_ignored(name: str, ignored: Sequence[str]) -> bool:
    """Whether a column is named among those that are not needed; * there stands for anything."""
    return any(fnmatchcase(name, pattern) for pattern in ignored)
