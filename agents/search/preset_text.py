"""Edits of a preset's YAML text that keep its other lines and its comments."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import yaml


def edited(text: str, changes: Mapping[str, Any]) -> str:
    """Return the text of a YAML file with settings changed.

    Parameters
    ----------
    text : str
        Sections at the margin, their entries indented by two spaces, or ``{...}`` on one line.
    changes : mapping
        Values by ``"section.entry"`` or ``"entry"``.
    """
    for name, value in changes.items():
        section, _, entry = name.rpartition(".")
        text = (
            _in_section(text, section, entry, value) if section else _at_margin(text, name, value)
        )
    return text


def _at_margin(text: str, entry: str, value: Any) -> str:
    line = f"{entry}: {_flow(value)}"
    made, count = re.subn(rf"^{entry}:[^#\n]*?(\s*#.*)?$", rf"{line}\1", text, flags=re.M)
    return made if count else f"{text.rstrip()}\n{line}\n"


def _in_section(text: str, section: str, entry: str, value: Any) -> str:
    inline = re.search(rf"^{section}: *(\{{.*\}})(.*)$", text, re.M)
    if inline:
        held = {**yaml.safe_load(inline[1]), entry: value}
        return (
            text[: inline.start()] + f"{section}: {_flow(held)}{inline[2]}" + text[inline.end() :]
        )
    block = re.search(rf"^{section}: *(#.*)?\n((?:(?: +.*)?\n)*)", text, re.M)
    if not block:
        return f"{text.rstrip()}\n{section}:\n  {entry}: {_flow(value)}\n"
    line = f"  {entry}: {_flow(value)}"
    found = re.search(rf"^  {entry}:[^#\n]*?(\s*#.*)?$(\n   +.*$|\n  - .*$)*", block[2], re.M)
    if found:
        inside = block[2][: found.start()] + line + (found[1] or "") + block[2][found.end() :]
    else:
        inside = f"{line}\n{block[2]}"
    return text[: block.start(2)] + inside + text[block.end(2) :]


def _flow(value: Any) -> str:
    """Return a value on one line; floats have a point, without which YAML 1.1 reads text."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{k}: {_flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_flow(entry) for entry in value) + "]"
    if isinstance(value, float):
        digits = repr(value)
        return digits.replace("e", ".0e") if "e" in digits and "." not in digits else digits
    text: str = yaml.safe_dump([value], default_flow_style=True, width=10**6)
    return text.strip()[1:-1]  # quoted as in a list, where a comma needs quotes
