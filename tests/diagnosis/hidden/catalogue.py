"""Catalogue of hidden effects, declared in `effects.toml`."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import effects as functions
from .base import Base
from .effect import Effect, Kind

DECLARED = tomllib.loads(Path(__file__).with_name("effects.toml").read_text(encoding="utf-8"))
EFFECTS, TUNING_UNKNOWN, FINAL_UNKNOWN = map(tuple, DECLARED.values())


def _kind(
    here: str,
    reference: float,
    candidate: str = "",
    constant: str = "",
    function: str = "",
    **more: Any,
) -> Kind:
    return Kind(constant or getattr(functions, function), reference, **more)


_KINDS: Mapping[str, Kind] = {
    name: _kind(**entry) for group in DECLARED.values() for name, entry in group.items()
}


def draw_effect(name: str, rng: np.random.Generator) -> Effect:
    """Draw the shape of the effect called `name`."""
    if name not in _KINDS:
        raise ValueError(f"no effect is called {name!r}; there are {', '.join(_KINDS)}")
    return _KINDS[name].effect(name, rng)


def constants(base: Base, effects: list[tuple[Effect, float]], duration: float) -> np.ndarray:
    """Return the record of a rig with its effects, each with an amplitude, shape (1,).

    The time of a slip is a share of the duration of the run [s].
    """
    record = base.parameters()
    for effect, amplitude in effects:
        effect.enter(record, amplitude)
    record["slip_time"] *= duration
    return record
