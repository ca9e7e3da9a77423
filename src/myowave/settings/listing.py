"""The table of settings as a person asks for it: groups, the keys of one group, or those that a word is found in."""

from collections import Counter
from collections.abc import Iterable, Sequence

from myowave.settings.keys import Key, did_you_mean


def list_groups(keys: Iterable[Key]) -> dict[str, tuple[int, str]]:
    """{group: (number of its keys, meaning)} in the order of config.yaml: sections, and what sections hold by name."""
    named = _by_name(keys)
    leaves = [name for name in named if not any(other.startswith(f"{name}.") for other in named)]
    counts = Counter(_group_of(name, leaves) for name in leaves)
    return {name: (counts[name], key.meaning) for name, key in named.items() if name in counts}


def find_keys(keys: Iterable[Key], words: Sequence[str]) -> list[Key]:
    """Keys of a group, or those with all of the words in name, unit or meaning; all where there is no word.

    Raises:
        ValueError: where nothing is found.
    """
    named = _by_name(keys)
    if not words:
        return list(named.values())
    below = [key for name, key in named.items() if len(words) == 1 and f"{name}.".startswith(f"{words[0]}.")]
    wanted = [word.lower() for word in words]
    texts = {name: f"{name} {key.unit} {key.meaning}".lower() for name, key in named.items()}
    found = below or [named[name] for name, text in texts.items() if all(word in text for word in wanted)]
    if not found:
        parts = sorted({part for name in named for part in name.split(".") if part.isidentifier()})
        asked = " ".join(words)
        raise ValueError(f"No setting has {asked!r} in its name or meaning{did_you_mean(asked, parts) or '.'}")
    return found


def describe(key: Key) -> tuple[str, str]:
    """Unit and default, and the meaning with what is allowed."""
    default = "required" if key.default is None else f"default {key.default}" if key.default else ""
    facts = "  ".join(fact for fact in (key.unit and f"[{key.unit}]", default) if fact)
    return facts, f"{key.meaning}: {key.allowed}"


def _group_of(name: str, leaves: Sequence[str]) -> str:
    """The first two parts of a key's name; its section where these are the key itself."""
    first, _, _ = name.partition(".")
    two = ".".join(name.split(".")[:2])
    return first if two in leaves else two


def _by_name(keys: Iterable[Key]) -> dict[str, Key]:
    return {key.name: key for key in keys}
