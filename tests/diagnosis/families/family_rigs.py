"""Recordings of simulated orthoses and arms with a hidden effect, at 50 Hz."""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.plants.core.replay import replay_plant
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from tests.diagnosis.families.joint_rig import PERIOD, campaign

SIZES = {"angle": 5e-4, "pressure": 400.0, "tension": 0.4}
"""Noise of the sensors [SI], by the first word of a channel."""


@dataclass(frozen=True)
class FamilyRig:
    """Simulated rig of a family.

    ``spread`` is that of base parameters about those of the default plant, in e-folds; ``inputs``
    gives the recorded inputs and those of the replay, from two setpoints of a pair of muscles.
    """

    plant: Any
    spread: Mapping[str, float]
    inputs: Callable[[Array, Array], tuple[dict[str, Array], dict[str, Any]]]
    outputs: tuple[str, ...]
    start: Any = None  # plant to diagnose, unless it is the family's default
    share: float = 1.0  # of the campaign in a recording

    @property
    def noise(self) -> dict[str, float]:
        """Noise by channel."""
        return {name: SIZES[name.partition("_")[0]] for name in self.outputs}

    @property
    def sheet(self) -> Rig:
        """Declared facts of the rig."""
        made = {k: getattr(self.plant, k) for k in self.plant.makes if k == "mounting"}
        return Rig(plant=self.plant.family, noise=self.noise, settled=True, variant=made)

    def truth(self, seed: int = 1, **hidden: float) -> Any:
        """Return a plant unlike the default one, with effects."""
        random = np.random.default_rng(seed)
        changed = {
            n: self.plant.value(n) * np.exp(random.uniform(-s, s)) for n, s in self.spread.items()
        }
        made = self.plant.replace({**changed, "regulator.dead_time": 0.02})
        return made.changed(hidden).without_noise()

    def recorded(self, seed: int = 4, **hidden: float) -> Recording:
        """Return a recording of a rig with hidden effects."""
        setpoints, labels = campaign(share=self.share)
        inputs, driving = self.inputs(setpoints["set_point_a"], setpoints["set_point_b"])
        found = replay_plant(self.truth(**hidden), driving, period=PERIOD, substeps=8)
        random = np.random.default_rng(seed)
        noisy = {
            name: found[name] + random.normal(0.0, size, len(labels))
            for name, size in self.noise.items()
        }
        time = PERIOD * np.arange(len(labels))
        return Recording.of_channels(time, inputs, noisy, plant=self.plant.family, segment=labels)


def _elbow(a: Array, b: Array) -> tuple[dict[str, Array], dict[str, Any]]:
    pose = {"intent": np.full(len(a), 1.0)}
    driving = {"command_a": a, "command_b": b, "start_a": a, "start_b": b, **pose}
    return {"set_point_a": a, "set_point_b": b, **pose}, driving


def _knee(a: Array, b: Array) -> tuple[dict[str, Array], dict[str, Any]]:
    return {"set_point": a}, {"set_point": a, "pressure": a}


def _arm(a: Array, b: Array) -> tuple[dict[str, Array], dict[str, Any]]:
    other = np.roll(a, len(a) // 3), np.roll(b, len(b) // 3)
    pressures = dict(enumerate((a, b, *other)))
    inputs = {f"set_point_{m}": values for m, values in pressures.items()}
    driving = {f"pressure_{m}": values for m, values in pressures.items()}
    return inputs, {**driving, "direct": 2.0}


MUSCLE = {"regulator.time_constant": 0.2}
ELBOW = FamilyRig(
    ElbowOrthosis.paper(),
    MUSCLE
    | dict.fromkeys(("bundle_a.pressure_each", "bundle_b.pressure_each"), 0.05)
    | dict.fromkeys(("hysteresis.loop", "link.damping", "wearer.stiffness"), 0.2)
    | {"link.mass": 0.15},
    _elbow,
    ("angle", "pressure_a", "pressure_b"),
)
KNEE = FamilyRig(
    KneeOrthosis.no_load(),
    MUSCLE
    | {"muscle.gain": 0.05, "hysteresis.width": 0.1, "lever.stiffness": 0.1}
    | {"lever.inertia": 0.15, "lever.damping": 0.3},
    _knee,
    ("angle", "pressure", "tension"),
)
HELD = FamilyRig(
    KneeOrthosis.rig(),
    MUSCLE | {"muscle.gain": 0.05, "hysteresis.width": 0.1},
    _knee,
    ("tension", "pressure"),
)
_PLANAR = RedundantManipulator.paper(chain=SerialChain.uniform(("x", "x")))
ARM = FamilyRig(
    _PLANAR,
    MUSCLE
    | {"muscle.area": 0.05, "muscle.taper": 0.05, "hysteresis.base": 0.2}
    | {"arm.mass_factor": 0.15, "arm.damping_factor": 0.2},
    _arm,
    ("angle_0", "angle_1", *(f"pressure_{m}" for m in range(4))),
    start=dataclasses.replace(_PLANAR),
    share=0.7,
)
