"""Suggestions at the end of messages about unknown names, and the name of this package."""

import difflib
from collections.abc import Iterable
from importlib import metadata


def near(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return "; did you mean 'x'?", or the known words, or ``otherwise`` if given."""
    choices = list(known)
    close = difflib.get_close_matches(word, choices, n=1, cutoff=0.6)
    if close:
        return f"; did you mean {close[0]!r}?"
    if otherwise:
        return otherwise
    return f"; known: {', '.join(choices)}" if choices else "; there are none"


def package() -> str:
    """Return name and version of the package, for reports."""
    try:
        return f"pam-envs {metadata.version('pam-envs')}"
    except metadata.PackageNotFoundError:
        return "pam-envs"
