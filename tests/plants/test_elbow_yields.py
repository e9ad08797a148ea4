"""Forces of the bundles of the elbow orthosis: yielding friction, viscosity, correction."""

import numpy as np
import pytest

from pam_envs.kernels.yielding import deflected_with_tail
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.plants.elbow_orthosis.rollout import simulate_elbow

YIELDING = {
    "hysteresis.loop": 0.0,
    "hysteresis.yield_force": 1.2,
    "hysteresis.yield_per_pressure": 4e-6,
    "hysteresis.yield_break": 0.004,
    "hysteresis.yield_ratio": 0.4,
    "hysteresis.yield_tail": 0.7,
}
SETTLED = 100
"""Control periods until the friction has forgotten its start."""


@pytest.fixture(
    scope="module",
    params=[("maxwell_slip_length", 0.0), ("maxwell_slip_length", 0.6), ("maxwell_slip", 0.6)],
)
def motion(request):
    """Record an elbow whose bundles stay taut.

    Return the plant, and of bundles a and b pressures [Pa], contractions [m] and the friction [N]
    that is missing in their forces, each (2, T).
    """
    kind, share = request.param
    yielding = YIELDING | {"hysteresis.yield_share": share}
    plant = ElbowOrthosis.paper(kind).with_lag_alone().replace(yielding)
    phase = 2.0 * np.pi * np.arange(400) / 200
    swing = 0.6e5 * np.sin(phase) + 0.3e5 * np.sin(3.0 * phase)
    commands = np.stack([2e5 - swing, 1.2e5 + swing], axis=1)
    made = simulate_elbow(plant, commands, intent=1.0, compiled=False)
    assert not made["slack"].any()
    pressure, contraction, force = (
        np.stack([made[f"{name}_{side}"] for side in "ab"])
        for name in ("pressure", "contraction", "force")
    )
    bundles = plant.bundle_a, plant.bundle_b
    law = np.stack([b.law(p, c) for b, p, c in zip(bundles, pressure, contraction, strict=True)])
    return plant, pressure, contraction, law - force


def test_friction_is_that_of_the_muscles_and_follows_their_contraction(motion):
    plant, pressure, contraction, friction = motion
    own = plant.hysteresis
    share = own.yield_share if own.drive == "length" else 1.0
    for m, bundle in enumerate((plant.bundle_a, plant.bundle_b)):
        strain, z = contraction[m] / bundle.nominal_length, 0.0
        before, expected = strain[0], np.zeros(len(strain))
        for t, (p, e) in enumerate(zip(pressure[m], strain, strict=True)):
            grown = 1.0 + own.yield_per_pressure * p / own.yield_force
            stiffer = 1.0 + share * (grown - 1.0)
            reach = own.yield_break * grown / stiffer
            z = deflected_with_tail(z, e - before, reach, own.yield_ratio, own.yield_tail)[0]
            stiff = own.yield_force / own.yield_break * stiffer
            before, expected[t] = e, bundle.muscles * stiff * z
        largest = np.abs(expected[SETTLED:]).max()
        assert largest > 0.8 * bundle.muscles * own.yield_force
        assert friction[m, SETTLED:] == pytest.approx(expected[SETTLED:], abs=0.02 * largest)


def test_friction_lowers_the_force_of_the_bundle_that_contracts(motion):
    plant, _, contraction, friction = motion
    for m, bundle in enumerate((plant.bundle_a, plant.bundle_b)):
        speed = np.gradient(contraction[m])
        quick = np.abs(speed) > 0.7 * np.abs(speed).max()
        quick[:SETTLED] = False
        along = np.sign(speed[quick]) * friction[m, quick]
        assert along.mean() > 0.5 * bundle.muscles * plant.hysteresis.yield_force


@pytest.mark.parametrize("kind", ["none", "maxwell_slip", "maxwell_slip_length"])
def test_force_of_a_bundle_lacks_that_of_the_viscosity_of_its_muscles(kind):
    plain = ElbowOrthosis.paper(kind).with_lag_alone().replace({"hysteresis.loop": 0.0})
    viscous = {"muscle.viscosity_per_pressure": 2e-3, "muscle.viscosity_relaxing": 0.5}
    plant = plain.replace({**viscous, "muscle.map_02": 1.0, "muscle.map_20": 2.0})
    swing = 0.6e5 * np.sin(2.0 * np.pi * np.arange(200) / 100)
    commands = np.stack([2e5 - swing, 1.2e5 + swing], axis=1)
    made = simulate_elbow(plant, commands, intent=1.0, compiled=False)
    assert not made["slack"].any()
    speed = plant.pulley.radius * made["velocity"]
    forces = plant.forces(made["angle"], made["pressure_a"], made["pressure_b"])
    for side, bundle, force, sign in zip(
        "ab", (plant.bundle_a, plant.bundle_b), forces, (-1, 1), strict=True
    ):
        share = np.where(sign * speed < 0.0, 0.5, 1.0)
        lost = bundle.muscles * 2e-3 * made[f"pressure_{side}"] * share * sign * speed
        assert np.ptp(lost) > 10.0
        assert force - made[f"force_{side}"] == pytest.approx(lost, abs=1e-6)


@pytest.mark.parametrize("shift", [0.0, -30.0])  # [N]; the second makes bundles slack
def test_stiffness_is_the_derivative_of_the_corrected_torque(shift):
    terms = {
        "muscle.map_00": shift,
        "muscle.map_02": 3.0,
        "muscle.map_12": -2.0,
        "muscle.map_30": 4.0,
        "muscle.map_13": 1.5,
    }
    ends = {"muscle.map_pressure": 5e5, "muscle.map_strain": 0.3, "muscle.map_least": -0.02}
    plain = ElbowOrthosis.paper("none")
    plant, pressures = plain.replace(terms | ends), (2.2e5, 3.1e5)
    angles = np.linspace(0.1, 1.9, 16)
    found = plant.stiffness(angles, *pressures)
    assert np.abs(found - plain.stiffness(angles, *pressures)).max() > 0.1
    step = 1e-5
    below, above = (plant.torque(angles + d, *pressures) for d in (-step, step))
    np.testing.assert_allclose(found, (below - above) / (2.0 * step), rtol=1e-4, atol=1e-3)
