"""Kinds of tracks by the plant of their episodes: the endings of the tracks' names.

A name is the family of the environment and what is special about the track, ``knee_walk_nominal``.
A track without one of these endings is of a kind of its own.
"""

from collections.abc import Mapping

from baselines.core.entry import Plants

NOMINAL = "nominal"  # the plant is the controllers' model
DRAWN = "randomised"  # parameters are drawn around the model
WRONG_MODEL = "wrong_model"  # another hysteresis than the model's
EVERYDAY = "everyday"  # with the effects of a normal day
PAYLOAD = "payload"  # of an unknown mass

NOT_THE_MODEL = (DRAWN, WRONG_MODEL, PAYLOAD)
"""Kinds whose plants differ from the controllers' model in parameters or structure."""
TUNED_ON: Mapping[Plants, str] = {"nominal": NOMINAL, "drawn": DRAWN}
"""Kind of the track on whose plants a search tunes."""


def is_of(track: str, kind: str) -> bool:
    """Return whether a track is of a kind."""
    return track.endswith(f"_{kind}")


def counterpart(track: str, kind: str, other: str) -> str | None:
    """Return the name of the track of another kind; None if the track is not of the first one."""
    return f"{track.removesuffix(kind)}{other}" if is_of(track, kind) else None
