"""SI units of the entries of ``info`` and of the inputs and outputs of plants."""

import re
from collections.abc import Mapping

_WORDS = {
    "Pa": "pressure set_point pressure_travel drive start_pressure held start",
    "m": "contraction length cop x y z reference_x reference_y reference_z",
    "rad": (
        "angle knee shank ankle deviation angle_reference joint_error joint_reference intent "
        "command"
    ),
    "rad/s": "velocity rate intent_rate knee_rate deviation_rate",
    "rad/s2": "intent_acceleration knee_acceleration",
    "N": "force tension ground_force ground_force_ahead ground_z ground_x heel prestress",
    "N m": (
        "torque torque_reference torque_ideal torque_clipped object_torque felt wearer demand "
        "estimate over_assistance disturbance"
    ),
    "N m/rad": "stiffness stiffness_reference stiffness_clipped hold",
    "N m s/rad": "hold_rate",
    "kg": "air used payload load",
    "K": "temperature",
    "s": "time",
    "turns": "phase",
}
_COMMON = {word: unit for unit, words in _WORDS.items() for word in words.split()}
_KNEE = {"stiffness": "N/m"}
_OWN: Mapping[str, Mapping[str, str]] = {
    "positioning": {"velocity": "m/s"},
    "single_muscle": {"velocity": "m/s"},
    "brace": _KNEE,
    "gait": _KNEE,
    "knee_orthosis": _KNEE,
    "elbow": {"command": "Pa"},
    "elbow_orthosis": {"command": "Pa"},
}
"""Units that differ, by family of environments or of plants."""
_INDEX = re.compile(r"_(?:\d+[ab]?|[ab])$")


def unit_of(name: str, family: str = "", own: Mapping[str, str] | None = None) -> str:
    """Return the SI unit of a quantity, ``"1"`` for a pure number.

    Parameters
    ----------
    name : str
        As ``state/pressure_a``: group, quantity, and muscle or joint.
    family : str
        Of environments or plants, whose own units come first.
    own : mapping, optional
        Units that come before all others.
    """
    group, _, word = name.rpartition("/")
    if group == "reward":
        return "1"
    tables = (own or {}, _OWN.get(family, {}), _COMMON)
    for known in (word, _INDEX.sub("", word)):
        for table in tables:
            if known in table:
                return table[known]
    return "1"
