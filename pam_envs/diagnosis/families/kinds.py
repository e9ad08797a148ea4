"""Kinds of plants by the name of their family."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.plant_protocol import Kind
from pam_envs.wording import near

KINDS = {
    "single_muscle": "MuscleKind",
    "antagonistic_joint": "JointKind",
    "elbow_orthosis": "ElbowKind",
    "knee_orthosis": "KneeKind",
    "redundant_manipulator": "ArmKind",
}
"""Class of each family that can be diagnosed, in the module of its name."""


def kind_named(name: str) -> Kind:
    """Return the kind of plants of a family; ValueError if it cannot be diagnosed."""
    if name not in KINDS:
        raise ValueError(
            f"plant: {name!r} cannot be diagnosed{near(name, KINDS)}. A simulation of any plant "
            "can be given from Python (pam_envs.diagnosis.Simulator)"
        )
    module = import_module(f"pam_envs.diagnosis.families.{name}")
    make: Callable[[], Kind] = getattr(module, KINDS[name])
    return make()


def plant_from(path: Path | None, sheet: Rig) -> Any:
    """Return the plant of a file, of the family of a rig; None without a file."""
    return None if path is None else type(kind_named(sheet.plant).start(sheet)).from_yaml(path)


def kind_of(plant: Any, sheet: Rig, declared: bool = True) -> Kind:
    """Return the kind of a plant, or of that of a rig file without one.

    ``declared``: whether the rig is known, whose family is then that of the plant.
    """
    own = getattr(plant, "kind", None)
    if own is not None:
        found: Kind = own
        return found
    family = getattr(plant, "family", sheet.plant)
    if declared and family != sheet.plant:
        raise ValueError(
            f"the plant is of family {family}, RIG.yaml says plant: {sheet.plant}; give the plant "
            "of the rig"
        )
    return kind_named(family)
