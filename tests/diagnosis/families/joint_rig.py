"""Recordings of a simulated antagonistic joint with a hidden effect."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.core.replay import replay_plant

PERIOD = 0.02
NOISE = {"angle": 5e-4, "pressure_a": 400.0, "pressure_b": 400.0}
SHEET = Rig(plant="antagonistic_joint", noise=NOISE, settled=True)
SPREAD = {
    "regulator.time_constant": 0.2,
    "muscle.area": 0.05,
    "muscle.taper": 0.05,
    "muscle.stiffness": 0.2,
    "hysteresis.base": 0.2,
    "hysteresis.rate": 0.2,
    "link.damping": 0.3,
    "link.mass": 0.15,
}
"""Spread of the rig's base parameters about those of the default plant, in e-folds."""
SHARE = 0.75
"""Of the campaign in a recording of the joint."""


def joint(seed: int = 1, **hidden: float) -> AntagonisticJoint:
    """Return a joint unlike the default one, with effects (``link__stick=0.004``)."""
    random, plant = np.random.default_rng(seed), AntagonisticJoint.paper()
    values = {n: plant.value(n) * np.exp(random.uniform(-s, s)) for n, s in SPREAD.items()}
    changed = plant.replace({**values, "regulator.dead_time": 0.02})
    return changed.changed(hidden).without_noise()


def campaign(seed: int = 1, share: float = 1.0) -> tuple[dict[str, Array], list[str]]:
    """Return the inputs of an experiment and the label of each sample.

    The whole takes about 100 s. A share of it has faster ramps and fewer steps; half of it is too
    little held-out data for a verdict.
    """
    random = np.random.default_rng(seed)

    def ramp(*corners: tuple[float, float]) -> Array:
        times = share * np.cumsum([seconds for seconds, _ in corners])
        values = [value for _, value in corners]
        return np.interp(np.arange(0.0, times[-1], PERIOD), times, values)

    def steps(number: int, least: float, most: float) -> list[Array]:
        holds = [round(random.uniform(1.2, 2.8) / PERIOD) for _ in range(round(share * number))]
        return [np.full(n, random.uniform(least, most)) for n in holds]

    time = np.arange(0.0, 12.0 * share, PERIOD)
    slow = ramp((0, 0), (4, 0), (6, 1.6e5), (12, -1.6e5), (6, 0))
    turns = ramp((0, 0), (4, 1.2e5), (8, -1.2e5), (6, 0.6e5), (4, -0.6e5), (3, 0))
    sweep = 1.4e5 * np.sin(2.0 * np.pi * (0.2 + 0.05 / share * time) * time)
    stepped = np.concatenate(steps(9, -1.6e5, 1.6e5))
    holds = steps(9, 0.5e5, 4e5)
    others = [holds[k] for k in random.permutation(len(holds))]
    parts = {
        "triangle": (2e5 + slow, 2e5 - slow),
        "steps": (2.2e5 + stepped, 2.2e5 - stepped),
        "sweep": (2.5e5 + sweep, 2.5e5 - sweep),
        "independent": (np.concatenate(holds), np.concatenate(others)),
        "turns": (2.2e5 + turns, 2.2e5 - turns),
    }
    inputs = {
        f"set_point_{'ab'[k]}": np.concatenate([p[k] for p in parts.values()]) for k in (0, 1)
    }
    labels = [name for name, part in parts.items() for _ in part[0]]
    loaded = np.isin(labels, ["independent", "turns"])
    return inputs | {"payload": np.where(loaded, 0.3, 0.0)}, labels


def readings(
    plant: AntagonisticJoint, inputs: Mapping[str, Array], seed: int = 4, **noise: float
) -> dict[str, Any]:
    """Return the noisy readings of a joint; ``noise`` [SI] by sensor."""
    channels = {"pressure_a": inputs["set_point_a"], "pressure_b": inputs["set_point_b"]}
    given = channels | {"payload": inputs["payload"], "direct": 2.0}
    found = replay_plant(plant, given, period=PERIOD, substeps=8)
    random = np.random.default_rng(seed)
    sizes = NOISE | noise
    return {name: v + random.normal(0.0, sizes[name], len(v)) for name, v in found.items()}


def recorded(share: float = SHARE, **hidden: float) -> Recording:
    """Return a recording of a joint with hidden effects, of a share of the campaign."""
    inputs, labels = campaign(share=share)
    found = readings(joint(**hidden), inputs)
    time = PERIOD * np.arange(len(labels))
    return Recording.of_channels(time, inputs, found, plant=SHEET.plant, segment=labels)
