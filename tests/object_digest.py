"""Digest of an object's complete content, for comparison of two objects."""

import dataclasses
import functools
import types
from collections.abc import Mapping
from typing import Any

import numpy as np

from benchmarks.identity.hashing import arrays_digest, canonical_text, digest, plain


def object_digest(thing: Any) -> str:
    """Return a digest of what an object holds: its class, its numbers and arrays, recursively.

    An object with a method ``digest()`` names itself.
    """
    return digest(_contents(thing, ()))[:16]


def _contents(thing: Any, above: tuple[int, ...]) -> Any:
    if isinstance(thing, type):
        return f"{thing.__module__}.{thing.__qualname__}"
    if callable(getattr(thing, "digest", None)):
        return {"digest": thing.digest()}
    if isinstance(thing, (int, float, str, bool, np.integer, np.floating)) or thing is None:
        return plain(thing)
    if isinstance(thing, np.ndarray):
        return {"array": arrays_digest([thing])}
    if id(thing) in above:
        return "above"
    above = (*above, id(thing))
    if isinstance(thing, Mapping):
        return {str(key): _contents(entry, above) for key, entry in thing.items()}
    if isinstance(thing, (list, tuple, set, frozenset)):
        entries = [_contents(entry, above) for entry in thing]
        ordered = isinstance(thing, (list, tuple))
        return entries if ordered else sorted(entries, key=canonical_text)
    held = held_by(thing)
    if held is None:
        return f"{thing.__module__}.{thing.__qualname__}"
    named = type(thing)
    return {
        "class": f"{named.__module__}.{named.__qualname__}",
        "holds": {name: _contents(entry, above) for name, entry in held.items()},
    }


def held_by(thing: Any) -> dict[str, Any] | None:
    """Return what an object holds by name, ``None`` for one that is only a name (a function)."""
    if isinstance(thing, types.MethodType):
        return {"function": thing.__func__, "of": thing.__self__}
    if isinstance(thing, functools.partial):
        return {"function": thing.func, "arguments": thing.args, "named": thing.keywords}
    if isinstance(thing, types.FunctionType):
        cells = [cell.cell_contents for cell in thing.__closure__ or ()]
        given = [thing.__defaults__, thing.__kwdefaults__]
        name = f"{thing.__module__}.{thing.__qualname__}"
        return {"name": name, "captured": cells, "defaults": given} if cells else None
    if dataclasses.is_dataclass(thing):
        return {field.name: getattr(thing, field.name) for field in dataclasses.fields(thing)}
    if hasattr(thing, "__qualname__"):
        return None
    slots = [name for kind in type(thing).__mro__ for name in getattr(kind, "__slots__", ())]
    held = {name: getattr(thing, name) for name in slots if hasattr(thing, name)}
    return held | dict(getattr(thing, "__dict__", {}))
