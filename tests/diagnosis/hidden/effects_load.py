"""Effects between muscle and load: clamp, wire, scales."""

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
    """Actual load different from the declared one: a tray [N], and scales with a gain error.

    The tray stands on a soft rest that a load presses down; without a load it only rubs on its
    guide. What the scales add is given at 30 N, over the tray.
    """
    put(
        record,
        tray=strength,
        tray_rest=shape["rest"],
        tray_scale=shape["scale"],
        tray_rub=shape["rub"],
    )


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
    "payload_error": Kind(
        lambda rng: {
            "rest": uniform(rng, 4.0, 9.0),
            "scale": uniform(rng, -0.25, 0.5),
            "rub": uniform(rng, 0.02, 0.08),
        },
        _payload_error,
        1.5,
    ),
}
