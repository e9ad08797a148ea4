"""Correction of the static law and yielding friction of the muscles of a pair."""

from itertools import pairwise

import numpy as np
import pytest

from pam_envs.kernels.yielding import deflected_with_tail, yielded, yielded_with_tail
from pam_envs.muscle.law_correction import FIELDS, NAMES, correction_force, correction_slope
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rollout import simulate_joint

JOINT = AntagonisticJoint.paper("none").with_lag_alone()
TERMS = {f"muscle.{name}": 3.0 - 0.4 * k for k, name in enumerate(NAMES)}
CORRECTION = {"muscle.map_02": 4.0, "muscle.map_13": -3.0, "muscle.map_20": 6.0}
RANGE = {"muscle.map_least": 0.02, "muscle.map_strain": 0.2, "muscle.map_pressure": 5e5}
YIELDING = {
    "muscle.yield_force": 4.0,
    "muscle.yield_per_pressure": 1e-5,
    "muscle.yield_break": 0.003,
    "muscle.yield_ratio": 0.4,
    "muscle.yield_tail": 0.7,
}
CYCLE, BEGUN = 720, 100
"""Control periods of a cycle of pressures, and of the way to its first pressure."""


@pytest.mark.parametrize("strain", [0.05, 0.12, 0.2])
@pytest.mark.parametrize("pressure", [0.5e5, 2e5, 4e5])
def test_compiled_correction_is_that_of_the_law_and_its_slope_the_derivative(pressure, strain):
    law = JOINT.replace(TERMS | RANGE).muscle
    rows = np.array([[getattr(law, name)] for name in FIELDS])
    force = correction_force(rows, 0, 0, pressure, strain)
    assert force == pytest.approx(float(law.correction(pressure, strain)), rel=1e-9)
    low, high = (float(law.correction(pressure, strain + d)) for d in (-1e-6, 1e-6))
    slope = correction_slope(rows, 0, 0, pressure, strain)
    assert slope == pytest.approx((low - high) / 2e-6, rel=1e-6)


def test_joint_settles_where_the_corrected_torques_balance_the_weight():
    plant = JOINT.replace(CORRECTION | RANGE)
    pressures = np.full(400, 3e5), np.full(400, 1.5e5)
    angle, plain = (
        simulate_joint(p, pressures=pressures, compiled=False)["angle"][-1] for p in (plant, JOINT)
    )
    assert abs(angle - plain) > 1e-3
    missing = float(plant.torque(angle, 3e5, 1.5e5)) - float(plant.weight_torque(angle, 0.0))
    assert missing == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("tail", [-1.0, -0.4, 0.0, 0.3, 1.0])
@pytest.mark.parametrize("ratio", [0.0, 0.6, 1.0])
@pytest.mark.parametrize("start", [-1.0, -0.3, 0.5, 1.0])
def test_friction_with_a_tail_solves_its_equation_and_creates_no_energy(tail, ratio, start):
    """Against a midpoint rule; ``y`` is the share along the motion."""
    way, steps = 3.0, 6000

    def rate(y):
        along = (1.0 - y) * (1.0 - tail * y)
        return along if y >= 0.0 else (1.0 - ratio * y) * (1.0 - max(0.0, tail) * ratio * y)

    y, work, far = start, 0.0, way / steps
    for k in range(steps):
        middle = y + 0.5 * far * rate(y)
        y, work = y + far * rate(middle), work + far * middle
        if k + 1 in (steps // 10, steps):
            for sign in (1.0, -1.0):
                moved = sign * far * (k + 1)
                z, slope = yielded_with_tail(sign * start, moved, ratio, tail)
                assert z == pytest.approx(sign * y, abs=2e-6)
                assert slope == pytest.approx(rate(y), abs=1e-5)
    assert work - 0.5 * (y * y - start * start) > -1e-6


def test_friction_with_a_tail_is_that_of_dahl_or_bouc_and_wen():
    for moved in (0.1, 1.0, 20.0, -0.4):
        assert yielded_with_tail(0.2, moved, 0.4, 0.0) == pytest.approx(yielded(0.2, moved, 0.4))
    assert yielded_with_tail(-1.0, 2.0, 1.0, 1.0)[0] == pytest.approx(1.0 - 2.0 / (1.0 + 2.0 * 2.0))
    assert yielded_with_tail(0.0, 0.7, 1.0, -1.0)[0] == pytest.approx(np.tanh(0.7), rel=1e-9)


def recorded(kind, yielding):
    """Record two equal cycles of a joint with yielding friction and taut muscles.

    Return the plant, pressures [Pa] and contractions, both (2, T), and by muscle the friction [N]
    that is missing in its force: of a contraction, positive if it opposes growth.
    """
    smooth = {"muscle.viscosity": 0.0, "muscle.imbalance": 0.0}
    plain = AntagonisticJoint.paper(kind).with_lag_alone().replace(smooth)
    plant = plain.replace(yielding)
    corners = np.array([3.6, 5.5, 3.5, 4.5, 3.9, 5.3, 3.6]) * 1e5
    share = 0.5 - 0.5 * np.cos(np.pi * np.arange(120) / 120)
    cycle = (corners[:-1, None] + np.diff(corners)[:, None] * share).ravel()
    pressures = np.tile(cycle, 2), np.full(2 * CYCLE, 4.5e5)
    made = simulate_joint(plant, pressures=pressures, compiled=False)
    assert not made["slack"].any()
    pressure, strain, force = (
        np.stack([made[f"{name}_{side}"] for side in "ab"])
        for name in ("pressure", "contraction", "force")
    )
    friction = plant.muscle.gain * plant.muscle.law(pressure, strain) - force
    return plant, pressure, strain, friction


@pytest.fixture(scope="module", params=["none", "maxwell_slip", "maxwell_slip_length"])
def cycles(request):
    return recorded(request.param, YIELDING)


def friction_of_elements(plant, pressure, strain):
    """Return the friction [N] without its yielding part, (2, T)."""
    straight = float(plant.lever.contraction(0.0, plant.muscle.rest_length)[0])
    states, made = [plant.hysteresis.model.initial_state((1,))] * 2, np.zeros(strain.shape)
    for t in range(strain.shape[1]):
        for m in range(2):
            at = strain[m, [t]] - straight
            drag, states[m] = plant.hysteresis.friction(at, pressure[m, [t]], states[m])
            made[m, t] = drag[0]
    return made


@pytest.mark.parametrize(
    "kind, share",
    [("none", 0.0), ("none", 1.0), ("maxwell_slip", 0.6), ("maxwell_slip_length", 0.0)],
)
def test_yielding_friction_of_each_muscle_follows_its_contraction(kind, share):
    plant, pressure, strain, friction = recorded(kind, YIELDING | {"muscle.yield_share": share})
    straight = float(plant.lever.contraction(0.0, plant.muscle.rest_length)[0])
    law, expected = plant.muscle, np.zeros(strain.shape)
    for m in range(2):
        at, before = 0.0, straight
        for t, (p, e) in enumerate(zip(pressure[m], strain[m], strict=True)):
            gained = law.yield_per_pressure * p
            stiff = (law.yield_force + share * gained) / law.yield_break
            most = (law.yield_force + gained) / stiff
            shape = most, law.yield_ratio, law.yield_tail
            at, before = deflected_with_tail(at, e - before, *shape)[0], e
            expected[m, t] = stiff * at
    found = friction - friction_of_elements(plant, pressure, strain)
    assert np.abs(expected).max() > 7.0
    assert found[:, BEGUN:] == pytest.approx(expected[:, BEGUN:], abs=0.05)


def test_yielding_friction_turns_with_the_motion_and_reaches_its_limit(cycles):
    plant, pressure, strain, friction = cycles
    law = plant.muscle
    found = friction - friction_of_elements(plant, pressure, strain)
    limit = law.yield_force + law.yield_per_pressure * pressure
    assert (np.abs(found) < 1.01 * limit)[:, BEGUN:].all()
    for m in range(2):
        turns = BEGUN + np.flatnonzero(np.diff(np.sign(np.diff(strain[m, BEGUN:])))) + 1
        sides = set()
        for first, last in pairwise(turns):
            way = strain[m, last] - strain[m, first]
            span = limit[m, first:last].max() / law.yield_force * law.yield_break
            if abs(way) > 5.0 * span:
                reached = np.sign(way) * found[m, first:last] / limit[m, first:last]
                assert reached[0] < 0.0 and reached.max() > 0.85
                sides.add(np.sign(way))
        assert sides == {-1.0, 1.0}


def test_yielding_friction_of_the_joint_creates_no_energy(cycles):
    """Its power, without that which its spring stores, is never positive; closed cycles lose."""
    plant, pressure, strain, friction = cycles
    law = plant.muscle
    found = friction - friction_of_elements(plant, pressure, strain)
    stored = 0.5 * found**2 * law.yield_break / law.yield_force  # [N], an energy by rest length
    moved = np.diff(strain, axis=1)
    taken = 0.5 * (found[:, 1:] + found[:, :-1]) * moved
    lost = taken - np.diff(stored, axis=1)
    limit = law.yield_force + law.yield_per_pressure * pressure.max()
    assert lost[:, BEGUN:].min() > -1e-3 * limit * law.yield_break
    second = taken[:, CYCLE - 1 :].sum(axis=1)
    assert np.abs(strain[:, CYCLE - 1] - strain[:, -1]).max() < 1e-4
    assert (second > 0.3 * limit * np.abs(moved[:, CYCLE - 1 :]).sum(axis=1)).all()


def test_friction_of_each_muscle_is_that_of_its_specimen():
    plain = AntagonisticJoint.paper("maxwell_slip_length").with_lag_alone()
    plain = plain.replace({"muscle.viscosity": 0.0, "muscle.imbalance": 0.0})
    plant = plain.replace({"muscle.friction_imbalance": 0.3})
    share = 1.0 - np.cos(2.0 * np.pi * np.arange(300) / 150)
    pressures = (3e5 + 0.8e5 * share, 4e5 - 0.8e5 * share)
    made = simulate_joint(plant, pressures=pressures, compiled=False)
    assert not made["slack"].any()
    for m, (side, factor) in enumerate((("a", 1.3), ("b", 0.7))):
        pressure, strain = made[f"pressure_{side}"], made[f"contraction_{side}"]
        law = plant.muscle.gain * plant.muscle.law(pressure, strain)
        usual = friction_of_elements(plant, np.stack([pressure] * 2), np.stack([strain] * 2))[m]
        found = law - made[f"force_{side}"]
        assert np.abs(usual).max() > 2.0
        assert found[150:] == pytest.approx(factor * usual[150:], abs=0.05)
