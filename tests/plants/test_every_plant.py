"""Battery over every plant: files, rows, bits, batches, replay and single steps."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pam_envs.hysteresis.protocol import kinds
from pam_envs.kernels.build import COMPILED
from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rollout import simulate_joint
from pam_envs.plants.core.replay import Stepper, replay_plant
from pam_envs.plants.core.rows import dotted, each, layout
from pam_envs.plants.elbow_orthosis.plant import MAKES, ElbowOrthosis
from pam_envs.plants.elbow_orthosis.rollout import simulate_elbow
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.knee_orthosis.rollout import simulate_knee
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.redundant_manipulator.rollout import simulate_manipulator
from pam_envs.plants.single_muscle.plant import SingleMuscle

PRESETS = ("paper", "measured", "reduced")


def plants_of(kind: Any) -> dict[str, Any]:
    """Return a plant of every make with one hysteresis, by name."""
    chain = SerialChain.uniform("xyz", mass=0.15)
    return {
        "muscle": SingleMuscle.mas10(kind, mass__damping=1000.0 / 3.0),
        "rig": KneeOrthosis.rig(kind, lever__damping=1.25),
        "rig, measured": KneeOrthosis.rig(kind, "measured"),
        "no load": KneeOrthosis.no_load(kind),
        "walk": KneeOrthosis.on_leg("walk", 1.5, kind, hysteresis__width=0.7),
        "walk, natural": KneeOrthosis.on_leg("walk", 1.224, kind),
        "stairs": KneeOrthosis.on_leg("stairs_up", 1.5, kind),
        **{p: getattr(AntagonisticJoint, p)(kind, muscle__viscosity=1e-4) for p in PRESETS},
        **{v: ElbowOrthosis.paper(kind, v, bundle_a__muscles=4) for v in MAKES},
        "arm": RedundantManipulator.paper(kind),
        "arm of three": RedundantManipulator.paper(kind, chain, link__damping=0.1),
    }


PLANTS = {(kind, name): plant for kind in kinds() for name, plant in plants_of(kind).items()}
EACH = pytest.mark.parametrize("key", PLANTS, ids=" ".join)


@EACH
def test_file_holds_the_whole_plant(key: tuple[str, str], tmp_path: Path) -> None:
    plant = PLANTS[key]
    plant.to_yaml(tmp_path / "plant.yaml")
    again = type(plant).from_yaml(tmp_path / "plant.yaml")
    assert again == plant and again.digest() == plant.digest()
    if key[1] == "muscle" and key[0] != "none":
        assert again.provenance == plant.provenance != {}
    assert len(again.ensemble) == len(plant.ensemble)
    assert list(tmp_path.iterdir()) == [tmp_path / "plant.yaml"]  # no temporary file left


def test_digests_of_different_plants_differ() -> None:
    plants = [*PLANTS.values(), KneeOrthosis.no_load(lever__stiffness=31.0)]
    plants += [AntagonisticJoint.paper(link__mass=0.4), SingleMuscle.mas10(mass__damping=300.0)]
    assert len({plant.digest() for plant in plants}) == len(plants)


@EACH
def test_parameter_rows_follow_their_names(key: tuple[str, str]) -> None:
    plant = PLANTS[key]
    rows, column = plant.module("rows"), plant.parameter_rows()
    assert rows.PARAMETERS + rows.EFFECTS == rows.NAMES == plant.names
    for name in plant.names:
        row = getattr(rows, name.replace(".", "_").upper())
        assert row == rows.place(name) and column[row] == plant.value(name)
    end = len(column) if key[1].startswith("arm") else rows.N_PARAMETERS
    assert len(column) == end
    if key[1] in MAKES:  # the kernels find bundle a in the first rows, bundle b after it
        muscles = column[rows.BUNDLE.muscles :: len(rows.BUNDLE)][:2]
        assert muscles.tolist() == [4.0, 7.0]
    quiet = plant.without_noise()
    shown = [n for n in plant.names if n.endswith((".noise", ".resolution"))]
    assert len(shown) >= 4 and max(map(plant.value, shown)) > 0.0
    assert not any(map(quiet.value, shown))


def test_equal_names_of_rows_are_refused() -> None:
    with pytest.raises(ValueError, match="two rows are named step, link_mass: rename"):
        layout(each("angle step link_mass"), dotted(link="mass"), {}, {})


def drawn(low: float, high: float, *shape: int, seed: int = 0) -> Any:
    """Return uniform numbers, each held for ten periods, shape (T, ...)."""
    numbers = np.random.default_rng(seed).uniform(low, high, (-(-shape[0] // 10), *shape[1:]))
    return np.repeat(numbers, 10, axis=0)[: shape[0]]


Lanes = int | slice
"""Which of three different commands: one of a single plant, several of a batch."""


def knee(plants: Any, lanes: Lanes, **options: Any) -> dict[str, Any]:
    commands = drawn(3e4, 4.3e5, 60, 3)[:, lanes]
    return simulate_knee(plants, commands, pressure=1e5, phase=0.4, **options)


def joint(plants: Any, lanes: Lanes, **options: Any) -> dict[str, Any]:
    commands, shoves = drawn(-0.5, 0.5, 60, 3), drawn(-4.0, 4.0, 60, 3, seed=2)
    given = {"disturbance": shoves[:, lanes], "payload": 0.3, **options}
    return simulate_joint(plants, commands[:, lanes], **given)


def elbow(plants: Any, lanes: Lanes, pulsed: bool = False, **options: Any) -> Any:
    command = drawn(*((-0.03, 0.05) if pulsed else (5e4, 5.5e5)), 60, 3, 2)[:, lanes]
    t = np.pi * 0.01 * np.arange(1, 61)
    intent = (1.0 - 0.6 * np.cos(t), 0.6 * np.pi * np.sin(t), 0.6 * np.pi**2 * np.cos(t))
    return simulate_elbow(
        plants, command, intent=intent, disturbance=1.5, pressures=(2e5, 3e5), **options
    )


RUNS: dict[str, Callable[..., dict[str, Any]]] = {
    "walk": knee, "rig, measured": knee, "no load": knee, "paper": joint, "reduced": joint,
    "proportional": elbow, "on_off": partial(elbow, pulsed=True),
}  # fmt: skip
VARIED = {
    "walk": ("stride.time", (1.3, 2.0, 5.0)),
    **dict.fromkeys(("rig, measured", "no load"), ("lever.damping", (1.1, 1.5, 2.0))),
    **dict.fromkeys(("paper", "reduced"), ("link.mass", (0.2, 0.3, 0.5))),
    **dict.fromkeys(MAKES, ("bundle_b.muscles", (5.0, 7.0, 9.0))),
}


@pytest.mark.skipif(not COMPILED, reason="needs the compiler")
@pytest.mark.parametrize("name", RUNS)
@pytest.mark.parametrize("kind", kinds())
def test_compiled_code_gives_the_bits_of_plain_python(kind: str, name: str) -> None:
    plant = PLANTS[kind, name]
    compiled, plain = (RUNS[name](plant, 0, compiled=c) for c in (True, False))
    for signal, values in plain.items():
        assert np.array_equal(values, compiled[signal]), signal


@pytest.mark.skipif(not COMPILED, reason="needs the compiler")
@pytest.mark.parametrize("kind", kinds())
def test_compiled_code_gives_the_bits_of_plain_python_for_the_arm(kind: str) -> None:
    plant, commands = RedundantManipulator.paper(kind), drawn(-0.5, 0.5, 20, 6)
    compiled, plain = (
        simulate_manipulator(plant, commands, payload=0.1, compiled=c) for c in (True, False)
    )
    for signal, values in plain.items():
        assert np.array_equal(values, compiled[signal]), signal


@pytest.mark.parametrize("name", RUNS)
def test_rows_of_a_batch_equal_the_single_plants(name: str) -> None:
    run, (key, values) = RUNS[name], VARIED[name]
    plants = [PLANTS["maxwell_slip", name].replace({key: value}) for value in values]
    batch = run(plants, slice(3))
    for k, plant in enumerate(plants):
        alone = run(plant, k)
        assert all(np.array_equal(alone[signal], batch[signal][:, k]) for signal in alone)


@pytest.mark.parametrize("pair", [("paper", "reduced"), ("proportional", "on_off"), ("walk",)])
def test_plants_of_several_makes_are_refused(pair: tuple[str, ...]) -> None:
    plants = [PLANTS["maxwell_slip", name] for name in pair] + [PLANTS["none", pair[0]]]
    for other in plants[1:]:
        with pytest.raises(ValueError, match="one variant"):
            RUNS[pair[0]]([plants[0], other], slice(2))


RAMP = np.linspace(0.0, 1.0, 20)
CASES: dict[str, tuple[Any, dict[str, Any], str]] = {
    "single_muscle": (SingleMuscle.mas10("none"), {"set_point": 3e5 * RAMP}, "contraction"),
    "knee_orthosis": (KneeOrthosis.no_load("none"), {"set_point": 3e5 * RAMP}, "angle"),
    "antagonistic_joint": (AntagonisticJoint.paper("none"), {"command": 0.2 * RAMP}, "angle"),
    "elbow_orthosis": (
        ElbowOrthosis.paper("none"),
        {"command_a": 1e5, "command_b": 2e5 + 2e5 * RAMP, "start_a": 1e5, "start_b": 2e5},
        "angle",
    ),
    "redundant_manipulator": (
        RedundantManipulator.paper("none"),
        {f"command_{k}": 0.1 * RAMP for k in range(6)},
        "angle_0",
    ),
}
EVERY = pytest.mark.parametrize("name", CASES)


@EVERY
def test_bias_and_drift_of_a_sensor_show_in_the_replay(name: str) -> None:
    plant, channels, key = CASES[name]
    sensor = "position" if name == "single_muscle" else "angle"
    off = plant.replace({f"{sensor}.bias": 0.01, f"{sensor}.drift": 0.001})
    plain, shown = (replay_plant(p, channels)[key] for p in (plant, off))
    assert np.allclose(shown - plain, 0.01 + 1e-5 * np.arange(20), rtol=1e-3)
    assert plain[-1] != plain[0]


@EVERY
def test_steps_give_the_readings_of_the_replay(name: str) -> None:
    plant, channels, _ = CASES[name]
    plant = plant.replace({"regulator.leak": 0.5})
    replayed, stepper = replay_plant(plant, channels), Stepper(plant)
    for k in range(19):
        now = {n: float(np.broadcast_to(v, 20)[k]) for n, v in channels.items()}
        read = stepper.step(**now)
        for sensor, values in replayed.items():
            assert read[sensor] == values[k + 1], sensor


@EVERY
def test_unknown_channel_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="the inputs are"):
        replay_plant(CASES[name][0], {"wind": 1.0})


def test_replay_of_the_knee_follows_its_rollout() -> None:
    plant, channels, _ = CASES["knee_orthosis"]
    made = simulate_knee(plant, channels["set_point"])
    shown = replay_plant(plant, channels)
    assert np.allclose(shown["angle"][1:], made["angle"][:-1], atol=1e-9)
    assert np.allclose(shown["tension"][1:], made["tension"][:-1], atol=1e-6)
