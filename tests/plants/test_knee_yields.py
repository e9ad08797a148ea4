"""Yielding friction of the muscle of a knee orthosis."""

import numpy as np
import pytest

from pam_envs.kernels.yielding import deflected_with_tail
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.knee_orthosis.rollout import simulate_knee

YIELDING = {
    "muscle.yield_force": 6.0,
    "muscle.yield_per_pressure": 2e-5,
    "muscle.yield_break": 0.006,
    "muscle.yield_ratio": 0.4,
    "muscle.yield_tail": 0.7,
}
CYCLE, SETTLED = 200, 100
"""Control periods of a cycle, and until the friction has forgotten its start."""
BRACE = KneeOrthosis.no_load("none")
PLANTS = {"brace": BRACE, "leg": KneeOrthosis.on_leg("walk", 1.4, "none")}


def yielding(plant: KneeOrthosis, share: float) -> KneeOrthosis:
    return plant.with_lag_alone().replace(YIELDING | {"muscle.yield_share": share})


@pytest.fixture(scope="module", params=[("brace", 0.0), ("brace", 0.6), ("leg", 0.6)])
def motion(request):
    """Simulate a brace; return the plant, pressures [Pa], strains and friction [N].

    The friction is the tension of the force law less the simulated tension.
    """
    name, share = request.param
    plant = yielding(PLANTS[name], share)
    phase = 2.0 * np.pi * np.arange(3 * CYCLE) / CYCLE
    command = 2e5 + 0.9e5 * np.sin(phase) + 0.3e5 * np.sin(3.0 * phase)
    made = simulate_knee(plant, command, pressure=command[0])
    length, muscle = plant.lever.length(made["angle"]), plant.muscle
    law = muscle.tension(muscle.gain * muscle.stiffness_ratio * made["pressure"], length)
    taut = made["tension"] > 0.0
    assert taut[SETTLED:].all()
    return plant, made["pressure"], 1.0 - length / plant.lever.full_length, law - made["tension"]


def test_friction_follows_the_contraction_of_the_muscle(motion):
    plant, pressure, strain, friction = motion
    own, z, before = plant.muscle, 0.0, strain[0]
    expected = np.zeros(len(strain))
    for t, (p, e) in enumerate(zip(pressure, strain, strict=True)):
        grown = 1.0 + own.yield_per_pressure * p / own.yield_force
        stiffer = 1.0 + own.yield_share * (grown - 1.0)
        reach = own.yield_break * grown / stiffer
        z = deflected_with_tail(z, e - before, reach, own.yield_ratio, own.yield_tail)[0]
        before, expected[t] = e, own.yield_force / own.yield_break * stiffer * z
    largest = np.abs(expected[SETTLED:]).max()
    assert largest > own.yield_force
    off = (friction - expected)[SETTLED:]  # reversals within a period are not recorded
    assert np.abs(off).max() < 0.08 * largest
    assert np.sqrt(np.mean(off**2)) < 0.01 * largest


def test_friction_of_a_cycle_takes_up_energy(motion):
    plant, _, strain, friction = motion
    last, force = strain[-CYCLE - 1 :], friction[-CYCLE - 1 :]
    work = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(last))  # [N], over the length
    assert work > 0.5 * plant.muscle.yield_force * np.ptp(last)


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_brace_with_yielding_friction_starts_at_rest(share):
    found = simulate_knee(yielding(BRACE, share), np.full(100, 2.5e5), pressure=2.5e5)
    assert np.ptp(found["angle"]) < 1e-4
    plain = simulate_knee(BRACE.with_lag_alone(), np.full(1, 2.5e5), pressure=2.5e5)
    assert found["angle"][0] > plain["angle"][0]  # inflation ended against the friction
