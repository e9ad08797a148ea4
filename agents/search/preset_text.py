"""Edits of a preset's YAML text that keep its other lines and its comments."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedSeq


def edited(text: str, changes: Mapping[str, Any]) -> str:
    """Return YAML text with values changed, by ``"section.entry"`` or ``"entry"``."""
    file = YAML()
    file.indent(mapping=2, sequence=4, offset=2)
    file.width = 10**6
    file.preserve_quotes = True
    file.representer.add_representer(float, _float)
    held = file.load(text)
    for name, value in changes.items():
        section, _, entry = name.rpartition(".")
        part = held.setdefault(section, {}) if section else held
        part[entry] = _on_one_line(value) if isinstance(value, (list, tuple)) else value
    made = io.StringIO()
    file.dump(held, made)
    return made.getvalue()


def _on_one_line(values: Any) -> CommentedSeq:
    made = CommentedSeq(values)
    made.fa.set_flow_style()
    return made


def _float(representer: Any, value: float) -> Any:
    """Write floats with a decimal point, without which YAML 1.1 reads text."""
    digits = repr(value)
    text = digits.replace("e", ".0e") if "e" in digits and "." not in digits else digits
    return representer.represent_scalar("tag:yaml.org,2002:float", text)
