"""Channels of a recording: name, column of a file, unit; inputs and outputs of each plant."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import BAR, MM

TRAVEL = 5e5
"""Excitation [Pa] that one full range of one input counts for."""
RESTING = 0.02
"""Share of its range within which a measured input counts as constant."""


@dataclass(frozen=True)
class Channel:
    """Channel of a recording."""

    name: str
    column: str = ""  # of a file
    unit: str = "1"  # of the column and of reports
    scale: float = 1.0  # the unit in SI

    @property
    def noise_key(self) -> str:
        """Key of its noise in a rig file: ``angle_noise_deg`` of ``angle_deg``."""
        stem, _, unit = self.column.rpartition("_")
        return f"{stem}_noise_{unit}"


@dataclass(frozen=True)
class Wiring:
    """Inputs and outputs of a plant in a recording."""

    inputs: tuple[Channel, ...]
    outputs: tuple[Channel, ...]
    # outputs that replace inputs where no command was recorded: input to output
    measured: Mapping[str, str] = field(default_factory=dict)

    @property
    def channels(self) -> dict[str, Channel]:
        """All channels by name."""
        return {c.name: c for c in (*self.inputs, *self.outputs)}


def bar(name: str, stem: str) -> Channel:
    """Return a channel of pressures."""
    return Channel(name, f"{stem}_bar", "bar", BAR)


DEGREE = math.pi / 180.0
MUSCLE = {
    "contraction": Channel("contraction", "contraction_mm", "mm", MM),
    "pressure": bar("pressure", "pressure"),
    "supply": bar("supply", "supply_pressure"),
    "force": Channel("force", "force_N", "N", 1.0),
}
"""Measured channels of a single muscle, by field of a recording."""
WIRINGS: dict[str, Wiring] = {
    "antagonistic_joint": Wiring(
        inputs=(
            bar("set_point_a", "pressure_command_a"),
            bar("set_point_b", "pressure_command_b"),
            Channel("payload", "payload_kg", "kg"),
            Channel("disturbance", "disturbance_Nm", "N m"),
        ),
        outputs=(
            Channel("angle", "angle_deg", "deg", DEGREE),
            bar("pressure_a", "pressure_a"),
            bar("pressure_b", "pressure_b"),
            Channel("torque", "torque_Nm", "N m"),
        ),
        measured={"set_point_a": "pressure_a", "set_point_b": "pressure_b"},
    ),
}
"""Channels of the plants with more than one muscle, by family."""


def excitation(inputs: Mapping[str, Array], samples: int, noisy: bool = False) -> Array:
    """Return the accumulated travel of all inputs, each over its range, in :data:`TRAVEL`.

    Holds of all inputs are constant in it, as holds of a command are. ``noisy`` inputs count as
    constant within a small share of their range.
    """
    total = np.zeros(samples)
    for values in inputs.values():
        span = float(np.ptp(values))
        if span > 0.0:
            moved = _rested(values, RESTING * span) if noisy else values
            total += np.cumsum(np.abs(np.diff(moved, prepend=moved[0]))) * (TRAVEL / span)
    return total


def _rested(values: Array, width: float) -> Array:
    """Return the output of a play operator of a half-width."""
    made, state = np.empty(len(values)), float(values[0])
    for k, value in enumerate(values.tolist()):
        state = min(max(state, value - width), value + width)
        made[k] = state
    return made
