"""The knee orthosis at rest: published points, presets, files, bad values."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from pam_envs.hysteresis.preisach import Preisach
from pam_envs.muscle.gas_spring import gas_volume
from pam_envs.plants.knee_orthosis.hysteresis import FULL_STIFFNESS, knee_hysteresis
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.knee_orthosis.rollout import simulate_knee

POINTS = ((0.5e5, 56.7), (0.75e5, 80.6), (2e5, 158.0), (4.5e5, 211.5))
"""Pressure [Pa] and tension [N] of the brace without load and without hysteresis."""


def test_the_brace_without_load_has_the_published_range() -> None:
    plant = KneeOrthosis.no_load("none")
    stiffness = plant.muscle.stiffness_ratio * np.array([p for p, _ in POINTS])
    angle = plant.angle_at(stiffness)
    length = plant.lever.length(angle)
    tension = plant.muscle.tension(stiffness, length)
    assert tension == pytest.approx([t for _, t in POINTS], rel=2e-3)
    assert np.degrees(angle[[0, -1]]) == pytest.approx([127.5, 96.6], abs=0.1)
    assert 100.0 * length[[0, -1]] == pytest.approx([24.2, 20.0], abs=0.05)
    assert stiffness[-1] == pytest.approx(FULL_STIFFNESS)
    assert plant.tension_for(angle) == pytest.approx(tension, rel=1e-9)
    assert plant.stiffness_for(tension, angle) == pytest.approx(stiffness, rel=1e-9)


def test_nominal_point_is_as_published() -> None:
    plant = KneeOrthosis.no_load("none")
    angle = float(plant.angle_at(plant.muscle.stiffness_ratio * 2e5))
    assert math.degrees(angle) == pytest.approx(110.0, abs=0.1)
    assert float(plant.lever.length(angle)) == pytest.approx(0.22, abs=2e-4)
    rig = KneeOrthosis.rig("none")
    tension = rig.muscle.tension(rig.muscle.stiffness_ratio * 2e5, rig.fixture.length)
    assert float(tension) == pytest.approx(158.0, abs=0.1)


def test_assistance_increases_with_tension() -> None:
    plant = KneeOrthosis.on_leg("walk")
    angles = np.radians([100.0, 120.0, 140.0])
    assert np.all(plant.tension_for(angles, 8.0) > plant.tension_for(angles, 0.0))


def test_volume_satisfies_virtual_work_of_the_muscle() -> None:
    """T = -P dV/dL."""
    muscle, h = KneeOrthosis.rig("none").muscle, 1e-6
    for length in (0.18, 0.22, 0.24):
        numbers = (muscle.shortest_length, muscle.stiffness_ratio, muscle.full_volume)
        less, more = (gas_volume(length + d, *numbers) for d in (-h, h))
        slope = (more - less) / (2 * h)
        tension = float(muscle.tension(muscle.stiffness_ratio * 2e5, length))
        assert -2e5 * slope == pytest.approx(tension, rel=1e-6)


def test_both_hysteresis_models_have_the_same_loops() -> None:
    slips, relays = (knee_hysteresis(kind).operator for kind in ("maxwell_slip", "preisach"))
    t = np.arange(900) / 300
    pressure = 2.25e5 * (1.0 - np.cos(2 * np.pi * t)) * (0.3 + 0.35 * (2 - np.floor(t)))
    assert pressure.max() == pytest.approx(4.5e5, rel=1e-3)
    first, second = slips.simulate(pressure)[0], relays.simulate(pressure)[0]  # type: ignore[union-attr]
    assert np.abs(first - second).max() < 0.01 * FULL_STIFFNESS
    up, down = first[75], first[225]
    assert (down - up) / FULL_STIFFNESS == pytest.approx(0.15, abs=0.03)


def test_preisach_of_a_nonlinear_spring_is_passive() -> None:
    model = knee_hysteresis("maxwell_slip").operator
    assert model is not None
    bent = dataclasses.replace(model, spring=tuple(p + 0.05 * p * p / 4e5 for p in model.spring))  # type: ignore[union-attr]
    assert Preisach.resembling(bent, 0.0, 4.5e5, 46, "low").table[-1][0] > 0.0  # type: ignore[arg-type]


def test_members_may_have_hysteresis_models_of_their_own() -> None:
    other = knee_hysteresis("maxwell_slip").operator.scaled(0.5)  # type: ignore[union-attr]
    plant = dataclasses.replace(KneeOrthosis.rig(), ensemble=({"hysteresis.operator": other},))
    tables = plant.hysteresis_tables()
    assert tables.shape == (2, 4, plant.elements)
    assert tables[1, 1, 0] == pytest.approx(0.5 * tables[0, 1, 0])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: KneeOrthosis(mounting="shelf"), r"mounting = 'shelf'.*rig, no_load, leg"),  # type: ignore[arg-type]
        (lambda: KneeOrthosis.rig("bouc"), r"hysteresis = 'bouc'"),  # type: ignore[arg-type]
        (lambda: KneeOrthosis.on_leg("hop"), r"activity = 'hop'"),  # type: ignore[arg-type]
        (lambda: KneeOrthosis.rig(lever__stiffness=-1.0), r"lever\.stiffness = -1"),
        (lambda: KneeOrthosis.rig(lever__colour=1.0), r"no parameter named 'lever\.colour'"),
        (lambda: dataclasses.replace(KneeOrthosis.rig(), substeps=0), r"substeps = 0"),
        (
            lambda: KneeOrthosis.on_leg("stairs_up", lever__mount_angle=1.8),
            r"past its toggle.*less than 1\.5",
        ),
        (
            lambda: KneeOrthosis.no_load(lever__inertia=1e-3, lever__damping=50.0),
            r"moves too fast.*use at least",
        ),
        (
            lambda: KneeOrthosis.rig("preisach", regulator__max_pressure=5e5),
            r"Everett map spans",
        ),
    ],
)
def test_bad_values_are_refused_with_a_remedy(make, message: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ValueError, match=message):
        make()


def test_plant_file_with_a_wrong_choice_is_named(tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text("schema: 1\nfamily: knee_orthosis\nmounting: shelf\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"rig\.yaml: mounting = 'shelf'"):
        KneeOrthosis.from_yaml(path)


@pytest.mark.parametrize("kind", ["none", "maxwell_slip_length"])
def test_brace_rests_where_the_corrected_tension_balances_its_wire(kind: str) -> None:
    held = {"hysteresis.friction": 0.0} if kind != "none" else {}
    plain = KneeOrthosis.no_load(kind).replace({"muscle.map_pressure": 4.5e5, **held})
    plant = plain.replace({"muscle.map_00": -12.0, "muscle.map_11": 6.0, "muscle.map_20": 4.0})
    pressure = 2e5
    stiffness = plant.muscle.gain * plant.muscle.stiffness_ratio * pressure
    made = simulate_knee(plant, np.full(400, pressure), compiled=False)
    angle = float(plant.angle_at(stiffness, pressure))
    assert abs(angle - float(plain.angle_at(stiffness))) > 5e-3
    assert made["angle"][-1] == pytest.approx(angle, abs=1e-4)
    length = float(plant.lever.length(made["angle"][-1]))
    assert made["tension"][-1] == pytest.approx(float(plant.pull(stiffness, pressure, length)))
