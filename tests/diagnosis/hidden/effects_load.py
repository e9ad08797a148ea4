"""Effects between the muscle and its load: clamp, wire, scales."""

from __future__ import annotations

import numpy as np

from .effect import Kind, Shape, coin, put, uniform


def _slip_step(record: np.ndarray, strength: float, shape: Shape) -> None:
    """A clamp gives way once; the load sinks by so many mm."""
    put(
        record,
        slip=strength,
        slip_time=shape["when"],
        slip_blur=shape["blur"],
        slip_kind=shape["sigmoid"],
    )


def _wire_slack(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The load stands on a support; its wire tightens progressively after a strain."""
    put(record, slack=strength, slack_blur=shape["blur"])


def _payload_error(record: np.ndarray, strength: float, shape: Shape) -> None:
    """A tray hangs with every load and is not told [N]; where nothing hangs, there is no tray.

    A tray that hangs `always` is a shift of the rest position and of the moving mass, which a
    refit of any clean muscle swallows. It is never drawn, and kept for tests of that.
    """
    put(record, tray=strength, tray_always=shape["always"])


LOAD = {
    "slip_step": Kind(
        lambda rng: {
            "when": uniform(rng, 0.2, 0.8),
            "blur": uniform(rng, 0.1, 0.5),
            "sigmoid": coin(rng),
        },
        _slip_step,
        0.08,
    ),
    "wire_slack": Kind(lambda rng: {"blur": uniform(rng, 0.15, 0.4)}, _wire_slack, 0.005),
    "payload_error": Kind(lambda _: {"always": 0.0}, _payload_error, 1.0),
}
