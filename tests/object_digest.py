"""Digest of an object's complete content, for comparison of two objects."""

import hashlib
from typing import Any

import cloudpickle


def object_digest(thing: Any) -> str:
    """Return a digest of what an object holds, closures included."""
    return hashlib.sha256(cloudpickle.dumps(thing)).hexdigest()
