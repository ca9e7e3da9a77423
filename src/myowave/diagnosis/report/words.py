"""Words of the pages: what each kind of verdict means, effects by their titles, terms explained on hover."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup, escape


@dataclass(frozen=True)
class Kind:
    """How a kind of verdict is told.

    Args:
        label: in a cell of a table.
        sentence: how much the verdict claims, below the headline, which it does not repeat; `explained` is a share.
        unexplained: whether something is left that no effect explains, so that a drafted effect is news.
    """

    label: str
    sentence: str
    unexplained: bool = False


# The one list of kinds; `kind_of` copes with further ones.
KINDS = {
    "adequate": Kind("adequate", "The model is adequate."),
    "effect": Kind("missing", "Nothing but noise is left."),
    "class": Kind("missing, with a choice", "Whichever it is, nothing but noise is left."),
    "partial": Kind(
        "missing, and more",
        "What is named explains {explained:.0%} of what is missing; more is left, which {rest}.",
        unexplained=True,
    ),
    "unknown": Kind("unknown", "So no effect is named, and none is added.", unexplained=True),
    "undecidable": Kind("not decidable", "These trials would look the same either way; other ones would not."),
}
BASE = "the published muscles and joint with the arm of the settings, and no effect added"
LOST = Kind("does not follow the motion", "The model does not follow these trials.")

GLOSSARY = {
    "base": f"The model to start from: {BASE}. A model with effects is written base+effect.",
    "held-out": "Kept aside: no fit and no choice has seen these trials. They tell how well new motion is predicted.",
    "RMSE": "Root mean square error: the typical distance between measured and predicted angle.",
    "R2": "Share of the variation that is explained: 1 is all of it, 0 no better than the mean, below 0 worse.",
    "delta BIC": "How much better the effect describes the data, after paying for its parameters (difference of the "
    "Bayesian information criterion). Above 10 is very strong evidence; below 0 the effect is not needed.",
    "scale": "Networks learn from coarse to fine: 3-scale learns slow motion first, then faster parts in two steps; "
    "1-scale learns the signals as they are.",
    "noise": "Scatter of the measured angle that no model can explain.",
    "missing torque": "Torque that would have to be added to the model to make its motion the measured one.",
    "absorbed": "Parameters that are fitted anyway do the work of the effect, so these data cannot show it.",
    "folds won": "Each training trial is left out in turn; a fold is won where the effect predicts that trial better.",
    "smallest detectable": "An effect weaker than this could not be seen in these data.",
    "standard error": "How far the estimate would scatter if the trials were recorded again (1 SD).",
    "95 % interval": "Holds the true value in 95 of 100 such recordings, if the model is right.",
    "class": "Effects that these data cannot tell apart.",
    "outside the catalogue": "Simple torques and excitations that no effect of the catalogue makes are tried, too, and "
    "muscle curves of any smooth shape near the published ones.",
}
LEAST_DEG = 0.0001  # no error smaller than this is told
_WRITTEN = {
    "base": r"base(?![+\w])",
    "held-out": r"held[- ]out",
    "R2": r"R2|R²",
    "scale": r"\d-scale|scales",
    "absorbed": r"absorbed|absorbs?",
    "standard error": r"standard error|SE",
}


def kind_of(verdict: Mapping[str, Any]) -> Kind:
    """How the kind of a verdict is told; one that is not in `KINDS` by its own name."""
    if not verdict.get("follows", True):
        return LOST
    kind = str(verdict["verdict"])
    return KINDS.get(kind, Kind(kind, f"The verdict is {kind}.", unexplained=bool(verdict.get("structure_left"))))


def tell_masked(masked: Mapping[str, Sequence[str]]) -> str:
    """Parameters with unusual values, and the effects that would explain these; those of the same effects together.

    Args:
        masked: {parameter: effects}.
    """
    groups: dict[tuple[str, ...], list[str]] = {}
    for parameter, effects in masked.items():
        groups.setdefault(tuple(effects), []).append(parameter)
    return "; ".join(
        f"{' and '.join(names)} {'is outside its' if len(names) == 1 else 'are outside their'} usual range, or "
        f"{' or '.join(effects)} is there"
        for effects, names in groups.items()
    )


def degrees(value: float) -> str:
    """An error in text, the same for one fact wherever it stands; no power of ten for one that nobody could measure."""
    return f"under {LEAST_DEG} deg" if value < LEAST_DEG else f"{two_digits(value)} deg"


def two_digits(value: float) -> str:
    """A number in text, with two significant digits and no power of ten for large ones; tables have one digit more."""
    return f"{value:.2g}" if abs(value) < 100 else f"{value:.0f}"


def noise(verdict: Mapping[str, Any]) -> str:
    """The noise of the measured angle in text, said to be a bound where it is one."""
    value = next(iter(verdict["rmse_deg"].values()))["noise"]
    return f"{'at most ' * bool(verdict.get('noise_is_bound'))}{degrees(value)}"


def noise_with_emg(verdict: Mapping[str, Any]) -> float | None:
    """What noise of the angle and of the recorded EMG make of the error together [deg]; none where the EMG has none."""
    if not verdict["emg_noise"]:
        return None
    return math.hypot(next(iter(verdict["rmse_deg"].values()))["noise"], verdict["emg_motion_deg"])


def tell(text: str, titles: Mapping[str, str]) -> Markup:
    """A text as HTML: effects with their titles, terms with their meaning on hover, each where it first stands.

    Args:
        titles: by effect; names within models, such as base+joint_damping, are left alone.
    """
    names = "|".join(sorted(map(re.escape, titles), key=len, reverse=True)) or "$^"
    terms = "|".join(rf"(?P<t{i}>{_WRITTEN.get(term, term)})" for i, term in enumerate(GLOSSARY))
    pattern = rf"(?<![\w+./])(?:(?P<effect>{names})(?![\w+/]|\.\w)|(?:{terms})(?!\w))"
    seen: set[str] = set()

    def mark(match: re.Match[str]) -> str:
        group, found = str(match.lastgroup), match[0]
        term = found if group == "effect" else list(GLOSSARY)[int(group[1:])]
        first = term not in seen
        seen.add(term)
        if group == "effect":
            return str(titled(found, titles)) if first else f"<code>{found}</code>"
        return f'<abbr title="{escape(GLOSSARY[term])}">{found}</abbr>' if first else found

    return Markup(re.sub(pattern, mark, str(escape(text))))


def titled(effect: str, titles: Mapping[str, str]) -> Markup:
    """An effect by its title, with the name that settings and models know it by."""
    title = titles.get(effect, "")
    name = Markup("<code>{}</code>").format(effect)
    return Markup("{} ({})").format(title, name) if title else name


def plain(effect: str, titles: Mapping[str, str]) -> str:
    """As `titled`, for pictures."""
    return f"{titles[effect]} ({effect})" if titles.get(effect) else effect
