"""Words of the pages: effects by their titles, terms explained on hover."""

import re
from collections.abc import Mapping

from markupsafe import Markup, escape

BASE = "the published muscles and joint with the arm of the settings, and no effect added"
GLOSSARY = {
    "EMG": "Electromyogram: the electrical activity of muscles, recorded by electrodes.",
    "base": f"The model to start from: {BASE}. A model with effects is written base+effect.",
    "held-out": "Kept aside: no fit and no choice has seen these trials. They tell how well new motion is predicted.",
    "RMSE": "Root mean square error: the typical distance between measured and predicted angle.",
    "R2": "Share of the variation that is explained: 1 is all of it, 0 no better than the mean, below 0 worse.",
    "log odds": "How much more probable the trials make the model with the effect than without, after paying for its "
    "parameters, as a natural logarithm: 3 is 20 to 1; below 0 the effect is not needed.",
    "scale": "Networks learn from coarse to fine: 3-scale learns slow motion first, then faster parts in two steps; "
    "1-scale learns the signals as they are.",
    "noise": "Scatter of the measured angle that no model can explain.",
    "missing torque": "Torque that would have to be added to the model to make its motion the measured one, RMS over "
    'the training trials; "under" is what noise of the angle alone would show.',
    "absorbed": "Parameters that are fitted anyway do the work of the effect, so these data cannot show it.",
    "smallest detectable": "An effect weaker than this could not be seen in these data.",
    "standard error": "How far the estimate would scatter if the trials were recorded again (1 SD).",
    "95 % interval": "Holds the true value in 95 of 100 such recordings, if the model is right.",
    "class": "Effects that these data cannot tell apart.",
    "outside the catalogue": "Simple torques and excitations that no effect of the catalogue makes are tried, too, and "
    "muscle curves of any smooth shape near the published ones.",
}
_WRITTEN = {
    "base": r"base(?![+\w])",
    "held-out": r"held[- ]out",
    "R2": r"R2|R²",
    "scale": r"\d-scale|scales",
    "absorbed": r"absorbed|absorbs?",
    "standard error": r"standard error|SE",
}


def explained(text: str, titles: Mapping[str, str]) -> Markup:
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
        return f'<abbr tabindex="0" title="{escape(GLOSSARY[term])}">{found}</abbr>' if first else found

    return Markup(re.sub(pattern, mark, str(escape(text))))


def titled(effect: str, titles: Mapping[str, str]) -> Markup:
    """An effect by its title, with the name that settings and models know it by."""
    name = Markup("<code>{}</code>").format(effect)
    return Markup("{} ({})").format(titles[effect], name) if titles.get(effect) else name


def named(model: str) -> Markup:
    """A model's name that may break after each +."""
    return Markup("+<wbr>").join(escape(part) for part in model.split("+"))
