"""Golden hashes of every plant's rollout, replay and stepper, plain and with effects.

``python -m tests.plants.plant_golden`` prints those that differ from the committed file;
``--write`` adds what is missing, ``--replace`` replaces the file.
"""

import hashlib
import json
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rollout import simulate_joint
from pam_envs.plants.core.stepper import PlantBatch, PlantStepper
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.plants.elbow_orthosis.rollout import simulate_elbow
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.knee_orthosis.rollout import simulate_knee
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.redundant_manipulator.rollout import simulate_manipulator
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.replay import Inputs, replay_rows
from pam_envs.plants.single_muscle.rollout import simulate
from tests.envs.positioning.variants import EVERY_EFFECT

FILE = Path(__file__).with_name("golden_plants.json")
KINDS = ("maxwell_slip", "preisach", "none")
Signals = dict[str, Any]


def wave(low: float, high: float, periods: int = 40, lead: float = 0.0) -> Any:
    """Return a raised cosine with a step in its middle, shape (T,)."""
    t = np.arange(periods) / periods
    half = np.where((t > 0.5) & (t < 0.6), 0.9, 0.5 - 0.5 * np.cos(4.0 * np.pi * (t + lead)))
    return low + (high - low) * half


def muscle(kind: Any) -> Signals:
    return simulate(SingleMuscle.mas10(kind), wave(0.0, 5e5, 60))


def replayed(kind: Any) -> Signals:
    """Replay one plant for each effect, and one with all of them."""
    plant = SingleMuscle.mas10(kind)
    plants = [plant, plant.replace(EVERY_EFFECT)]
    plants += [plant.replace({name: value}) for name, value in EVERY_EFFECT.items()]
    plants.append(plant.replace({"mass.stick": 3.0, "muscle.viscosity": 200.0}))
    command = wave(0.0, 5e5, 48)
    command[20:24] = -1.0
    start = np.arange(48)
    inputs = Inputs(
        0.025,
        command,
        np.where(start < 30, 2.5, 3.5),
        np.linspace(293.15, 300.0, 48),
        (start == 0) | (start == 40),
        np.full(48, 4e4),
        start == 10,
    )
    made = replay_rows(plant, np.stack([p.parameter_rows() for p in plants]), inputs)
    return {"contraction": made[0], "pressure": made[1]}


def stepped(kind: Any) -> Signals:
    plain = SingleMuscle.mas10(kind)
    plant = plain.replace(EVERY_EFFECT)
    batch = PlantBatch([plain, plant], 2.5, kelvin=300.0)
    one = PlantStepper(plant, 1.5, noise_seed=3)
    shown = [one.step(p) for p in wave(0.0, 5e5, 20)]
    return {
        "batch": batch.run(np.stack([wave(0.0, 4e5, 20), wave(1e5, 5e5, 20)], axis=1)),
        "one": np.array(shown),
        "ahead": one.try_ahead([1e5, 2e5, 4e5], 5),
    }


def knee(make: Any, kind: Any, **choices: Any) -> Signals:
    return simulate_knee(make(hysteresis=kind, **choices), wave(0.0, 3e5), phase=0.1, pressure=5e4)


def joint(make: Any, kind: Any, **extra: Any) -> Signals:
    plant = make(kind)
    moved = simulate_joint(
        plant, wave(-0.4, 0.4), disturbance=wave(-0.5, 0.5), payload=0.05, **extra
    )
    return moved


def elbow(kind: Any, valves: Any, **changes: float) -> Signals:
    wide = (0.02, 0.04) if valves == "on_off" else (5e4, 4e5)
    command = np.stack([wave(*wide), wave(*wide, lead=0.3)], axis=1)
    if valves == "on_off":
        command -= 0.03
    return simulate_elbow(
        ElbowOrthosis.paper(kind, valves, **changes), command, intent=(wave(0.8, 1.4), 0.1, 0.0),
        disturbance=0.2,
    )  # fmt: skip


def arm(kind: Any) -> Signals:
    plant = RedundantManipulator.paper(kind)
    commands = wave(0.0, 0.3, 20)[:, None] * np.linspace(-1.0, 1.0, plant.stages)
    return simulate_manipulator(plant, commands, payload=0.02, disturbance=0.1)


def cases() -> dict[str, Callable[[], Signals]]:
    """Return what is hashed, by name."""
    found: dict[str, Callable[[], Signals]] = {}
    for kind in KINDS:
        found[f"muscle/{kind}"] = partial(muscle, kind)
        found[f"replay/{kind}"] = partial(replayed, kind)
        found[f"stepper/{kind}"] = partial(stepped, kind)
        for name in ("rig", "no_load", "on_leg"):
            for dynamics in ("lag", "measured"):
                made = partial(knee, getattr(KneeOrthosis, name), kind, dynamics=dynamics)
                found[f"knee/{name}/{dynamics}/{kind}"] = made
        for name in ("paper", "measured", "reduced"):
            found[f"joint/{name}/{kind}"] = partial(joint, getattr(AntagonisticJoint, name), kind)
        given = {"pressures": (wave(0.0, 4e5), wave(4e5, 1e5))}
        found[f"joint/pressures/{kind}"] = partial(joint, AntagonisticJoint.paper, kind, **given)
        quasi = {"quasi_static": True}
        found[f"joint/quasi_static/{kind}"] = partial(joint, AntagonisticJoint.paper, kind, **quasi)
        for valves in ("proportional", "on_off"):
            found[f"elbow/{valves}/{kind}"] = partial(elbow, kind, valves)
        found[f"arm/{kind}"] = partial(arm, kind)
    drag = {"muscle__viscosity": 300.0, "muscle__viscosity_per_pressure": 1e-3}
    law = {"muscle__map_02": 1.0, "muscle__map_13": -0.5, "muscle__map_20": 1.0}
    for name in ("no_load", "on_leg"):
        make = getattr(KneeOrthosis, name)
        found[f"knee/{name}/viscous"] = partial(knee, make, "maxwell_slip", **drag)
    for valves in ("proportional", "on_off"):
        made = partial(elbow, "maxwell_slip_length", valves, **drag, **law)
        found[f"elbow/{valves}/viscous_and_corrected"] = made
    return found


CASES = cases()


def digest(name: str) -> str:
    """Return the hash of one record."""
    made = CASES[name]()
    total = hashlib.sha256()
    for signal in sorted(made):
        values = np.ascontiguousarray(made[signal], np.float64)
        total.update(f"{signal}{values.shape}".encode())
        total.update((values + 0.0).tobytes())
    return total.hexdigest()


def committed() -> dict[str, str]:
    """Return the committed hashes by name."""
    return dict(json.loads(FILE.read_text())) if FILE.exists() else {}


def main() -> None:
    """Compare with the committed file, or write it."""
    old = {} if "--replace" in sys.argv else committed()
    new = {name: digest(name) for name in CASES}
    for name, value in new.items():
        if old.get(name) != value:
            print(f"{name}: {old.get(name)} -> {value}")
    if {"--write", "--replace"} & set(sys.argv):
        FILE.write_text(json.dumps(new | old, indent=1) + "\n")


if __name__ == "__main__":
    main()
