"""Mapping from the channels of a log file to the columns of a recording: ``channels`` in RIG.yaml.

    channels:
      time_s: {from: AI/time, unit: ms}
      contraction_mm: {from: AI/position, scale: 12.5, offset: -3.0, unit: mm}
      pressure_bar: AI/pressure               # in the unit that the file states
      load_N: {value: 2.5, unit: kg}          # a constant that was not logged

A reading is ``scale`` times the number in the file plus ``offset``, in ``unit``.
"""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from pam_envs import yaml_file
from pam_envs.wording import near, shown

KEYS = ("from", "unit", "scale", "offset", "value")
MOST = 100
"""Largest number of mapped columns."""


@dataclasses.dataclass(frozen=True)
class ChannelSource:
    """Source of one column of a recording.

    Attributes
    ----------
    source : str
        Name of the channel in the file; empty for a constant.
    unit : str
        Unit of the scaled reading; empty: the unit that the file states, or that of the column.
    scale : float
        Factor from the number in the file to the reading [unit per number].
    offset : float
        Reading at the number 0 [unit].
    value : float or None
        Constant reading [unit], for a column that was not logged.
    """

    source: str = ""
    unit: str = ""
    scale: float = 1.0
    offset: float = 0.0
    value: float | None = None

    @property
    def scaled(self) -> bool:
        """Whether the numbers in the file are not readings in its unit."""
        return (self.scale, self.offset) != (1.0, 0.0)


def sources_of(given: Any) -> dict[str, ChannelSource]:
    """Return the channels of a section of RIG.yaml, by column.

    Raises
    ------
    ValueError
        Naming the key, its value and the remedy.
    """
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise ValueError(
            "channels must be a mapping from columns of the recording to channels of the file, "
            f"for example {{pressure_bar: AI/pressure}}, got {shown(given)}"
        )
    if len(given) > MOST:
        raise ValueError(f"channels has {len(given)} entries; give at most {MOST}")
    return {str(column): _channel(f"channels.{column}", entry) for column, entry in given.items()}


def _channel(key: str, entry: Any) -> ChannelSource:
    if isinstance(entry, str) and entry.strip():
        return ChannelSource(entry.strip())
    if not isinstance(entry, Mapping):
        raise ValueError(
            f"{key} must be the name of a channel or a mapping with the keys {', '.join(KEYS)}, "
            f"got {shown(entry)}"
        )
    for name in entry:
        if name not in KEYS:
            raise ValueError(f"unknown key {shown(f'{key}.{name}')}{near(str(name), KEYS)}")
    if ("from" in entry) == ("value" in entry):
        raise ValueError(f"{key} needs either from (a channel of the file) or value (a constant)")
    text: dict[str, str] = {}
    for name in ("from", "unit"):
        word = entry.get(name, "")
        if not isinstance(word, str) or (name in entry and not word.strip()):
            raise ValueError(f"{key}.{name} must be text, got {shown(word)}; put it in quotes")
        text[name] = word.strip()
    numbers = {n: _number(f"{key}.{n}", entry[n]) for n in KEYS[2:] if n in entry}
    if numbers.get("scale") == 0.0:
        raise ValueError(f"{key}.scale is 0; give the reading per number in the file")
    if "value" in numbers and len(numbers) > 1:
        raise ValueError(f"{key} has value together with scale or offset; give value alone")
    return ChannelSource(text["from"], text["unit"], **numbers)


def _number(key: str, given: Any) -> float:
    number = yaml_file.number(given)
    if number is None or not math.isfinite(number):
        raise ValueError(f"{key} must be a finite number, got {shown(given)}")
    return number
