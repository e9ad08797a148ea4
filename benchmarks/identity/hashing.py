"""One text for equal contents, and the digest of that text."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import math
import types
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np


def plain(value: Any) -> Any:
    """Return ``value`` in JSON's own types: NaN and infinities become ``None``.

    Raises
    ------
    TypeError
        If there is something that JSON has no form for.
    """
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    raise TypeError(f"cannot write {type(value).__name__} as JSON: {value!r}")


def canonical_text(value: Any) -> str:
    """Return the one JSON text of a value: keys sorted, floats to the last bit."""
    return json.dumps(plain(value), sort_keys=True, separators=(",", ":"), allow_nan=False)


def digest(value: Any) -> str:
    """Return the SHA-256 of the canonical text, 64 hexadecimal digits."""
    return hashlib.sha256(canonical_text(value).encode()).hexdigest()


def arrays_digest(arrays: Iterable[Any]) -> str:
    """Return the SHA-256 of arrays (shape, type and bits), 16 hexadecimal digits."""
    state = hashlib.sha256()
    for array in arrays:
        exact = np.ascontiguousarray(array)
        state.update(f"{exact.dtype.str}{exact.shape}".encode())
        state.update(exact.tobytes())
    return state.hexdigest()[:16]


SOURCES = {".py", ".yaml", ".yml", ".csv", ".json", ".npz", ".onnx", ".safetensors"}


def sources_digest(paths: Iterable[Path], kinds: Collection[str] = SOURCES) -> str:
    """Return the SHA-256 of files and of folders' code and data by relative name, 16 digits.

    Parameters
    ----------
    paths : iterable of Path
    kinds : collection of str
        Suffixes of the files that count.
    """
    state = hashlib.sha256()
    for root in paths:
        files = sorted(root.rglob("*")) if root.is_dir() else [root]
        for file in files:
            if file.is_file() and file.suffix in kinds:
                state.update(file.relative_to(root.parent).as_posix().encode())
                state.update(file.read_bytes())
    return state.hexdigest()[:16]


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


PLAIN = frozenset({float, int, bool, type(None)})
"""Classes of numbers, of which a plant may hold thousands."""


def classes_in(thing: Any) -> Iterator[type]:
    """Yield the class of an object and of all that it holds, each once; not those of numbers."""
    seen: set[int] = set()
    kinds: set[type] = set()
    left = [thing]
    while left:
        entry = left.pop()
        if type(entry) in PLAIN or isinstance(entry, (type, str, bytes, np.ndarray, np.generic)):
            continue
        if id(entry) in seen:
            continue
        seen.add(id(entry))
        if type(entry) not in kinds:
            kinds.add(type(entry))
            yield type(entry)
        if isinstance(entry, Mapping):
            left += entry.values()
        elif isinstance(entry, (list, tuple, set, frozenset)):
            left += entry
        else:
            left += (held_by(entry) or {}).values()
