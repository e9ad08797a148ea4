"""Canonical text of equal contents, and its digest."""

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np


def plain(value: Any) -> Any:
    """Return ``value`` in JSON's own types: NaN and infinities become ``None``."""
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
    """Return the canonical JSON text of a value: keys sorted, floats to the last bit."""
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
