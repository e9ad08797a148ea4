"""Guarded reader of all YAML files: plants, rigs, scenarios, settings and tables of constants.

Size, depth and the length of a scalar are bounded, and aliases are refused, on the stream of
events, before anything is built: nested brackets would overflow the stack, and aliases of aliases
grow exponentially where they are shown. Only plain values are built.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from pam_envs.wording import printable

MOST_BYTES = 1_000_000
MOST_DEPTH = 50
LONGEST = 20_000
"""Largest number of characters of a scalar."""
LONGEST_MESSAGE = 2000
"""Largest number of characters of an error about the content."""
_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def read(path: str | Path, what: str) -> Any:
    """Return the content of a file; a ValueError names ``what`` it is, its path and the fault."""
    where = f"{what} {path}"
    try:
        with open(path, "rb") as file:
            data = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise ValueError(f"{where} cannot be read: {error.strerror or error}") from error
    if len(data) > MOST_BYTES:
        raise ValueError(f"{where} has more than {MOST_BYTES:,} bytes; split it or leave data out")
    try:
        return parse(data.decode("utf-8-sig"), where)
    except UnicodeDecodeError as error:
        raise ValueError(f"{where} is not YAML: it is not text in UTF-8") from error


def parse(text: str, where: str) -> Any:
    """Return the content of a YAML text; a ValueError begins with ``where``."""
    try:
        _check(yaml.parse(text, Loader=_LOADER))
        return yaml.load(text, Loader=_LOADER)
    except Exception as error:  # constructors of tags raise errors of several classes
        raise ValueError(f"{where} is not YAML: {printable(str(error))[:500]}") from error


def _check(events: Iterator[Any]) -> None:
    depth = 0
    for event in events:
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        elif isinstance(event, yaml.AliasEvent):
            raise ValueError(f"it has the alias *{str(event.anchor)[:80]}; write the value out")
        elif isinstance(event, yaml.ScalarEvent) and len(event.value) > LONGEST:
            raise ValueError(f"it has an entry of more than {LONGEST:,} characters; shorten it")
        if depth > MOST_DEPTH:
            raise ValueError(f"it has more than {MOST_DEPTH} levels; write it with fewer")


def number(value: Any) -> float | None:
    """Return a number of a file, also one without a sign in its exponent, which YAML reads as text.

    None if the value is no number, or too large for one.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        return None
    try:
        return float(value)
    except (ValueError, OverflowError):
        return None


@contextmanager
def naming(where: str) -> Iterator[None]:
    """Name a file at the beginning of every error about its content, which becomes a ValueError."""
    try:
        yield
    except ValueError as error:
        text = printable(str(error))
        text = text if len(text) <= LONGEST_MESSAGE else f"{text[:LONGEST_MESSAGE]}..."
        raise type(error)(text if text.startswith(where) else f"{where}: {text}") from error
    except (TypeError, AttributeError, LookupError, ArithmeticError, RecursionError) as error:
        raise ValueError(f"{where}: malformed: {error}") from error
