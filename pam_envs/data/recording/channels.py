"""Channels of a recording: name, column of a file, unit; inputs and outputs of each plant."""

import math
from collections.abc import Iterable, Mapping
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
SIDES = ("a", "b")


def pair_channels(*more: Channel) -> Wiring:
    """Return the channels of a joint between two muscles; ``more`` are further inputs."""
    return Wiring(
        inputs=(*(bar(f"set_point_{s}", f"pressure_command_{s}") for s in SIDES), *more),
        outputs=(
            Channel("angle", "angle_deg", "deg", DEGREE),
            *(bar(f"pressure_{s}", f"pressure_{s}") for s in SIDES),
            Channel("torque", "torque_Nm", "N m"),
            *(Channel(f"force_{s}", f"force_{s}_N", "N") for s in SIDES),
        ),
        measured={f"set_point_{s}": f"pressure_{s}" for s in SIDES},
    )


def arm_channels(joints: int) -> Wiring:
    """Return the channels of an arm; muscles 2 k and 2 k + 1 move joint k."""
    muscles = range(2 * joints)
    return Wiring(
        inputs=(
            *(bar(f"set_point_{m}", f"pressure_command_{m}") for m in muscles),
            Channel("payload", "payload_kg", "kg"),
            *(Channel(f"disturbance_{k}", f"disturbance_{k}_Nm", "N m") for k in range(joints)),
        ),
        outputs=(
            *(Channel(f"angle_{k}", f"angle_{k}_deg", "deg", DEGREE) for k in range(joints)),
            *(bar(f"pressure_{m}", f"pressure_{m}") for m in muscles),
            *(Channel(f"torque_{k}", f"torque_{k}_Nm", "N m") for k in range(joints)),
            *(Channel(f"force_{m}", f"force_{m}_N", "N") for m in muscles),
        ),
        measured={f"set_point_{m}": f"pressure_{m}" for m in muscles},
    )


ARM, MOST_JOINTS = "redundant_manipulator", 8
DISTURBANCE = Channel("disturbance", "disturbance_Nm", "N m")
WIRINGS: dict[str, Wiring] = {
    "antagonistic_joint": pair_channels(Channel("payload", "payload_kg", "kg"), DISTURBANCE),
    "elbow_orthosis": pair_channels(Channel("intent", "intent_deg", "deg", DEGREE), DISTURBANCE),
    "knee_orthosis": Wiring(
        inputs=(bar("set_point", "pressure_command"),),
        outputs=(
            Channel("angle", "angle_deg", "deg", DEGREE),
            bar("pressure", "pressure"),
            Channel("tension", "tension_N", "N"),
            Channel("torque", "torque_Nm", "N m"),
        ),
        measured={"set_point": "pressure"},
    ),
    ARM: arm_channels(MOST_JOINTS),
}
"""Channels of the plants other than a single muscle, by family."""


def wiring_of(family: str, columns: Iterable[str]) -> Wiring:
    """Return the channels of a plant; of an arm, those of the joints that a file has."""
    if family != ARM:
        return WIRINGS[family]
    known = {c.column: c.name for c in WIRINGS[ARM].channels.values()}
    last = 0
    for column in columns:
        stem, _, number = known.get(column, "").rpartition("_")
        if number.isdigit():
            muscle = stem in ("set_point", "pressure", "force")
            last = max(last, int(number) // 2 if muscle else int(number))
    return arm_channels(last + 1)


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
