"""Suggestions at the end of messages about unknown names, and the name of this package."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from importlib import metadata


def near(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return "; did you mean 'x'?", or what there is to choose from.

    Parameters
    ----------
    word : str
        What was given.
    known : iterable of str
        What might have been meant.
    otherwise : str
        What to say in place of all that is known, where nothing known is near.
    """
    choices = list(known)
    close = difflib.get_close_matches(word, choices, n=1, cutoff=0.6)
    if close:
        return f"; did you mean {close[0]!r}?"
    return otherwise or f"; known: {', '.join(choices)}"


def package() -> str:
    """Return name and version of the package, for reports."""
    try:
        return f"pam-envs {metadata.version('pam-envs')}"
    except metadata.PackageNotFoundError:
        return "pam-envs"
