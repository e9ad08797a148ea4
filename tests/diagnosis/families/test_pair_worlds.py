"""Rigs of the worlds of joints and arms: mechanical stops, and recordings that keep off them."""

import numpy as np
import pytest

from tests.diagnosis.pair_worlds import FAMILIES, WORLDS, engine, record, rigs

ARM = "redundant_manipulator"
SEEDS = range(100_000, 100_006)


def angles_of(recording) -> np.ndarray:
    return np.array([v for name, v in recording.outputs.items() if name.startswith("angle")])


@pytest.mark.parametrize("world", WORLDS)
def test_clean_arms_are_recorded_clear_of_their_stops(world):
    """Seed 100,002 of the second world would reach its stop with the setpoints of the others."""
    for seed in SEEDS:
        recording, sheet = record(ARM, world, seed)
        noise = 6.0 * sheet.noise["angle_0"]
        assert np.abs(angles_of(recording)).max() < rigs.CLEAR + noise < rigs.STOP
        assert np.ptp(angles_of(recording), axis=1).min() > 0.6  # the joints move nevertheless


def test_hidden_effect_leaves_the_setpoints_of_an_arm_unchanged():
    clean, _ = record(ARM, "exponential", 100_002)
    faulty, _ = record(ARM, "exponential", 100_002, {"unequal": 0.3})
    assert all(np.array_equal(v, faulty.inputs[name]) for name, v in clean.inputs.items())
    full, _ = record(ARM, "exponential", 100_003)
    swings = [np.ptp(r.inputs["set_point_0"] - r.inputs["set_point_1"]) for r in (clean, full)]
    assert swings[0] < 0.95 * swings[1]


@pytest.mark.parametrize("stop", [rigs.STOP, np.inf])
def test_joint_that_is_pulled_past_its_range_rests_against_its_stop(stop):
    """A spring of 12 N m/rad pulls the link towards 90 degrees, against muscles at 2 bar."""
    family = FAMILIES["antagonistic_joint"]
    random = np.random.default_rng(3)
    muscles = rigs._muscles(family, random, {})
    kinds = np.array([engine.EXPONENTIAL, engine.DAHL, engine.LIMITED_LAG, family.place])
    inertia, damping, weight, _, _ = family.joint
    joints = np.array([[inertia, damping, weight, 12.0, 0.5 * np.pi, 0.0, 0.55, 0.05, 2e-3]])
    valve = rigs._valve(engine.LIMITED_LAG, random, {})
    link = np.array([*family.link, stop])
    data = (kinds, muscles, valve, joints, np.array(family.geometry), link)
    commands, payload = np.full((2, 200), 2.0), np.zeros(200)
    angles, _, _ = engine.run(*data, commands, payload, rigs.PERIOD, rigs.SUBSTEPS)
    if np.isfinite(stop):
        assert angles.min() > rigs.STOP and angles.max() < rigs.STOP + np.radians(2.0)
        assert np.ptp(angles) < 1e-3
    else:
        assert angles.min() > rigs.STOP + np.radians(10.0)


def test_a_stop_pushes_back_with_loss_and_never_pulls():
    inside, pressed = engine.stopped(0.6, 1.0, 0.61), engine.stopped(0.63, 0.0, 0.61)
    assert inside == 0.0
    assert pressed == pytest.approx(-engine.CONTACT * 0.02**1.5)
    assert engine.stopped(-0.63, 0.0, 0.61) == pytest.approx(-pressed)
    assert engine.stopped(0.63, 1.0, 0.61) < pressed < engine.stopped(0.63, -1.0, 0.61) < 0.0
    assert engine.stopped(0.63, -100.0, 0.61) == 0.0
