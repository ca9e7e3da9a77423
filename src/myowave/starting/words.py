"""Words in names of files and columns: which muscle, which angle, and which names may be those of people.

What a name says is only ever a guess, and whoever uses it says so.
"""

import re

FLEXORS, EXTENSORS = ("biceps", "brachioradialis", "brachialis"), ("triceps", "anconeus")
"""Muscles over the elbow that skin electrodes reach, the most usual first."""

_MUSCLES = {
    # Also in German, French, Italian and Spanish, and as OpenSim's models of the arm write them (BIClong, TRIlat).
    "biceps": r"\b[rl]?b[ií]c|\bbizeps|\bbb\b",
    "triceps": r"\b[rl]?tr[ií]c|\btrizeps|\btri(lat|long|med)?\b|\btb\b",
    "brachioradialis": r"\b[rl]?brachiorad|\bbrd\b|\bbr\b",
    "brachialis": r"\b[rl]?brachialis\b|\bbra\b",
    "anconeus": r"\b[rl]?anco",
    "deltoid": r"\b[rl]?delt",
    "pectoralis": r"\b[rl]?pect?\b|\b[rl]?pectoral",
    "trapezius": r"\b[rl]?trap",
    "pronator": r"\b[rl]?pronator",
}
_ELBOW = {
    r"\belbow|\bell(en)?bogen|\bcoude|\bcodo\b|\bgomito": 4,
    r"flex|beugung": 2,
    r"\bang(les?|ulo)\b|winkel|\bgonio": 1,
    r"\bangles? x$": 1,
}
_NOT_ELBOW = (
    r"pitch|roll|yaw|shoulder|upper ?arm|\bwrist|\bhand|hip|knee|ankle|lumbar|neck|rotation|pronat|supinat|ulnar|"
    r"abduct|adduct|\bforce|torque|moment|velocity|speed|acc|gyr|mag\b"
)
_NOT_EMG = r"\bacc|\bgyr|\bmag\b|\bforce|\btrigger|\bsync|\bpress|\btime\b|\bimu\b|\bquat|\btemp"
_ANGLE = (
    r"\bang(le|ulo)|winkel|flex|beugung|elbow|ell(en)?bogen|coude|\bcodo\b|gomito|\bjoint|gonio|pitch|\broll|\byaw|motion|"
    r"kinemat"
)
# Written out, not as beginnings: ant... would let Anton through. Left out is what is a name as well, such as long.
_TECHNICAL = re.compile(
    r"emgs?|accelerometer|acc|gyro|mag|avanti|trigno|delsys|noraxon|ultium|myomotion|myomuscle|sensor|channel|chan|ch|"
    r"analog|voltage|volts?|imported|devices?|model|outputs?|signal|value|data|raw|envelope|filt|filtered|rms|norm|normalised|normalized|time|zeit|temps|tiempo|elbow|shoulder|wrist|"
    r"upper|fore|lower|arm|joints?|segments?|angles?|flex|flexion|flexor|ext|extension|extensor|pitch|roll|yaw|"
    r"rotation|right|left|rt|lt|lat|lateral|med|medial|ant|anterior|post|posterior|[rl]?bic|[rl]?biceps|[rl]?tric?|"
    r"[rl]?triceps|brachii|brach|brachialis|brachiorad|brachioradialis|bb|tb|br|brd|bra|anconeus|delt|deltoid|pect|"
    r"pectoralis|biclong|bicshort|trilong|trilat|trimed|bizeps|trizeps|ellbogen|ellenbogen|ellbogenwinkel|winkel|beugung|"
    r"coude|codo|gomito|trap|trapezius|pronator|teres|goniometer|gonio|deg|rad|uv|mv|motion|[rl]?elbow|[a-z]"
)


def plain(text: str) -> str:
    """Words in small letters with single blanks between them: `LElbowAngles.x` is `l elbow angles x`."""
    text = re.sub(r"\b(BIC|TRI|BRA)(?=[a-z])", lambda found: found[0].lower(), text)  # OpenSim's BIClong
    text = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", text)
    return " ".join(re.findall(r"[a-zà-öø-ÿµ]+|\d+", text.lower()))


def muscle_in(text: str) -> str | None:
    """The muscle that a name speaks of, or none."""
    words = plain(text)
    return next((muscle for muscle, pattern in _MUSCLES.items() if re.search(pattern, words)), None)


def says_emg(text: str) -> bool:
    """Whether a name speaks of EMG or of a muscle."""
    return "emg" in plain(text) or muscle_in(text) is not None


def says_angle(text: str) -> bool:
    """Whether a name speaks of an angle or of motion."""
    return re.search(_ANGLE, plain(text)) is not None


def says_other(text: str) -> bool:
    """Whether a name speaks of what is neither EMG nor an angle, such as an accelerometer."""
    return re.search(_NOT_EMG, plain(text)) is not None


def elbow_score(text: str) -> int:
    """How much a name speaks of the flexion of the elbow; at most 0 where it does not."""
    words = plain(text)
    return sum(points for pattern, points in _ELBOW.items() if re.search(pattern, words)) - 5 * bool(
        re.search(_NOT_ELBOW, words)
    )


def is_technical(label: str) -> bool:
    """Whether every word of a label is a technical one, so that it holds nobody's name."""
    return all(word.isdigit() or _TECHNICAL.fullmatch(word) for word in plain(label).split())
