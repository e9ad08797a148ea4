"""Plants: valve, muscle with hysteresis, load and sensors, each as one frozen value."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
    from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
    from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
    from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
    from pam_envs.plants.single_muscle.plant import SingleMuscle

_FOLDERS = {
    "AntagonisticJoint": "antagonistic_joint",
    "ElbowOrthosis": "elbow_orthosis",
    "KneeOrthosis": "knee_orthosis",
    "RedundantManipulator": "redundant_manipulator",
    "SingleMuscle": "single_muscle",
}
__all__ = [
    "AntagonisticJoint",
    "ElbowOrthosis",
    "KneeOrthosis",
    "RedundantManipulator",
    "SingleMuscle",
]


def __getattr__(name: str) -> Any:
    """Import a plant at its first use."""
    if name not in _FOLDERS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_FOLDERS[name]}.plant"), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_FOLDERS])
