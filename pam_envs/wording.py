"""Values and suggestions in messages, and the name of this package."""

import difflib
import reprlib
from collections.abc import Iterable, Sequence
from importlib import metadata
from typing import Any

_LONGEST = 100
_SHORT = reprlib.Repr()
_SHORT.maxlevel, _SHORT.maxstring, _SHORT.maxother, _SHORT.maxlong = 3, 80, 80, 40


def near(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return "; did you mean 'x'?", or the known words, or ``otherwise`` if given."""
    choices = list(known)
    close = difflib.get_close_matches(word[:_LONGEST], choices, n=1, cutoff=0.6)
    if close:
        return f"; did you mean {close[0]!r}?"
    if otherwise:
        return otherwise
    return f"; known: {', '.join(choices)}" if choices else "; there are none"


def enumeration(items: Sequence[str]) -> str:
    """Return "a, b and c"."""
    return " and ".join(part for part in (", ".join(items[:-1]), *items[-1:]) if part)


def shown(value: Any) -> str:
    """Return a value for a message: at most about 100 printable characters, whatever it is."""
    try:
        text = _SHORT.repr(value)
    except Exception:  # a number of too many digits, or a class that cannot name itself
        text = f"<{type(value).__name__}>"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


def printable(text: str) -> str:
    """Return text with control characters and line separators escaped, newlines and tabs kept."""
    return "".join(c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in text)


def package() -> str:
    """Return name and version of the package, for reports."""
    try:
        return f"pam-envs {metadata.version('pam-envs')}"
    except metadata.PackageNotFoundError:
        return "pam-envs"
