"""Checked settings: frozen dataclasses from mappings, with errors that name the remedy."""

import dataclasses
import math
import types
from collections.abc import Mapping, Sequence
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from pam_envs import yaml_file
from pam_envs.wording import near, shown


class SettingsError(ValueError):
    """An invalid setting; the message contains the remedy."""


def number(default: Any, low: float, high: float) -> Any:
    """Return a dataclass field for a number (or several) from ``low`` to ``high``."""
    return dataclasses.field(default=default, metadata={"bounds": (low, high)})


def choice(default: Any, *choices: str) -> Any:
    """Return a dataclass field for one of several words."""
    return dataclasses.field(default=default, metadata={"choices": choices})


def build(cls: type, given: Any, where: str = "") -> Any:
    """Return ``cls``, a frozen dataclass, made from a mapping, every entry checked.

    Nested dataclasses are built from nested mappings, ``where`` is the mapping's dotted name for
    messages. A SettingsError names the entry, its value and the remedy.
    """
    if not isinstance(given, Mapping):
        raise SettingsError(f"{where or 'the settings'} must be a mapping, got {shown(given)}")
    fields = {field.name: field for field in dataclasses.fields(cls)}
    hints = get_type_hints(cls)
    values = {}
    for key, value in given.items():
        place = f"{where}.{key}" if where else str(key)
        if key not in fields:
            raise SettingsError(f"unknown setting {shown(place)}{near(str(key), list(fields))}")
        values[key] = _value(hints[key], value, place)
        _check_field(fields[key], values[key], place)
    missing = [
        name
        for name, field in fields.items()
        if name not in values
        and field.default is dataclasses.MISSING
        and field.default_factory is dataclasses.MISSING
    ]
    if missing:
        raise SettingsError(f"{where or 'the settings'} must set {', '.join(missing)}")
    return cls(**values)


def _value(kind: Any, value: Any, place: str) -> Any:
    """Return ``value`` as the annotated type, or raise."""
    origin = get_origin(kind)
    if origin in (Union, types.UnionType):
        return _one_of(get_args(kind), value, place)
    if dataclasses.is_dataclass(kind):
        return build(kind, value, place)  # type: ignore[arg-type]
    if origin is tuple:
        return _several(get_args(kind), value, place)
    if origin is Literal:
        return _known(value, get_args(kind), place)
    if origin in (dict, Mapping):
        if not isinstance(value, Mapping) or not all(isinstance(k, str) for k in value):
            raise SettingsError(f"{place} = {shown(value)} must be a mapping from names to values")
        return dict(value)
    return _plain(kind, value, place)


def _known(value: Any, known: Sequence[str], place: str) -> Any:
    if value not in known:
        raise SettingsError(f"{place} = {shown(value)} is not known{near(str(value), [*known])}")
    return value


def _one_of(kinds: tuple[Any, ...], value: Any, place: str) -> Any:
    if value is None and type(None) in kinds:
        return None
    error: SettingsError | None = None
    for kind in kinds:
        if kind is not type(None):
            try:
                return _value(kind, value, place)
            except SettingsError as refused:
                error = error or refused
    raise error or SettingsError(f"{place} = {shown(value)} has an unknown type")


def _several(kinds: tuple[Any, ...], value: Any, place: str) -> tuple[Any, ...]:
    if not isinstance(value, (list, tuple)):
        raise SettingsError(f"{place} = {shown(value)} must be a list")
    if kinds[-1] is not Ellipsis and len(value) != len(kinds):
        raise SettingsError(f"{place} = {shown(value)} must have {len(kinds)} entries")
    return tuple(_value(kinds[0], entry, f"{place}[{i}]") for i, entry in enumerate(value))


def _plain(kind: Any, value: Any, place: str) -> Any:
    if kind is bool and isinstance(value, bool):
        return value
    if kind is int and isinstance(value, int) and not isinstance(value, bool):
        return value
    number = yaml_file.number(value) if kind is float else None
    if number is not None and math.isfinite(number):
        return number
    if kind is str and isinstance(value, str):
        return value
    names = {bool: "true or false", int: "a whole number", float: "a finite number", str: "text"}
    raise SettingsError(f"{place} = {shown(value)} must be {names.get(kind, kind)}")


def _check_field(field: dataclasses.Field[Any], value: Any, place: str) -> None:
    if "choices" in field.metadata:
        _known(value, field.metadata["choices"], place)
    if "bounds" not in field.metadata or value is None or isinstance(value, str):
        return
    low, high = field.metadata["bounds"]
    for one in value if isinstance(value, tuple) else (value,):
        if not low <= one <= high:
            raise SettingsError(f"{place} = {shown(one)} must be from {low:g} to {high:g}")
