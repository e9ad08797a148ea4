"""Rigs of the worlds of joints and arms: mechanical stops, and recordings that keep off them."""

import numpy as np
import pytest

from tests.diagnosis.pair_worlds import FAMILIES, HIDDEN, WORLDS, engine, fields, record, rigs

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
@pytest.mark.parametrize("world", ["exponential", "polynomial"])
def test_joint_that_is_pulled_past_its_range_rests_against_its_stop(world, stop):
    """A spring of 12 N m/rad pulls the link towards 90 degrees, against muscles at 2 bar."""
    family = FAMILIES["antagonistic_joint"]
    random = np.random.default_rng(3)
    law, friction, regulator = WORLDS[world]
    muscles = rigs._muscles(family, random, {}, law)
    kinds = np.array([law, friction, regulator, family.place])
    inertia, damping, weight, _, _ = family.joint
    joints = np.array([[inertia, damping, weight, 12.0, 0.5 * np.pi, 0.0, 0.55, 0.05, 2e-3]])
    valve = rigs._valve(regulator, random, {})
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


def muscle_of(world: str, seed: int) -> np.ndarray:
    """Return a muscle of an antagonistic joint."""
    random = np.random.default_rng(seed)
    return rigs._muscles(FAMILIES["antagonistic_joint"], random, {}, WORLDS[world][0])[0]


@pytest.mark.parametrize("seed", range(700_000, 700_010))
@pytest.mark.parametrize("world", WORLDS)
def test_force_grows_with_pressure_and_falls_with_contraction(world, seed):
    law, c = WORLDS[world][0], muscle_of(world, seed)
    strains, pressures = np.linspace(-0.05, c[1], 60), np.linspace(0.0, 5.0, 60)
    force = np.array([[engine.law(law, c, p, e) for e in strains] for p in pressures])
    assert force.min() >= 0.0
    assert np.diff(force, axis=0).min() >= 0.0 and np.diff(force, axis=1).max() <= 0.0
    pulling = force[:-1] > 0.1 * c[0]
    assert np.diff(force, axis=0)[pulling].min() > 0.0
    assert engine.law(law, c, 2.0, 0.0) == pytest.approx(c[0])
    assert engine.law(law, c, 2.0, 1.1 * c[1]) < 0.02 * c[0]


def test_polynomial_muscle_has_no_kink_where_it_goes_slack():
    c = muscle_of("polynomial", 700_000)
    strains = np.linspace(0.0, 1.3 * c[1], 4001)
    force = np.array([engine.law(engine.POLYNOMIAL, c, 1.0, e) for e in strains])
    slope = np.gradient(force, strains)
    assert force[-1] == slope[-1] == 0.0
    assert np.abs(np.diff(slope)).max() < 0.01 * np.abs(slope).max()


@pytest.mark.parametrize("seed", range(700_000, 700_006))
@pytest.mark.parametrize(
    ("world", "falling"), [*((w, False) for w in WORLDS), ("polynomial", True)]
)
def test_friction_dissipates_over_closed_cycles_with_random_inner_loops(world, seed, falling):
    """A width that falls with the contraction is that of a muscle which goes slack."""
    kind, c = WORLDS[world][1], muscle_of(world, seed)
    random = np.random.default_rng(seed)
    corners = np.array([0.0, *np.cumsum(random.normal(0.0, 0.01, 30))])
    corners -= np.linspace(0.0, corners[-1], len(corners))
    corners -= corners.min()
    cycle = np.interp(np.linspace(0.0, 1.0, 30_001), np.linspace(0.0, 1.0, 31), corners)
    path = np.concatenate([cycle, cycle[1:], cycle[1:]])
    moves, state, elements = np.diff(path), [0.0], np.zeros(fields.ELEMENTS)
    for du in moves:
        if kind == engine.MAXWELL_SLIP:
            state.append(engine.slip(c, elements, du))
        else:
            state.append(engine.loop(kind, c, state[-1], du))
    z, width = np.array(state), np.exp(-20.0 * path) if falling else np.ones(len(path))
    force = width * z
    work = np.cumsum(0.5 * (force[1:] + force[:-1]) * moves)
    assert np.abs(z).max() <= 1.0 + 1e-12
    assert work.min() > -1e-6  # never gives back more than it took
    assert work[-1] - work[59_999] > 1e-4


def test_maxwell_slip_closes_its_inner_loops_and_slips_as_a_whole_in_the_end():
    c, elements = muscle_of("polynomial", 700_001), np.zeros(fields.ELEMENTS)
    engine.slip(c, elements, 0.01)
    kept = elements.copy()
    engine.slip(c, elements, -0.002)
    engine.slip(c, elements, 0.002)
    assert elements == pytest.approx(kept)
    assert engine.slip(c, elements, 0.2) == pytest.approx(1.0)
    assert engine.slip(c, elements, -0.4) == pytest.approx(-1.0)


def test_orifice_flow_chokes_at_low_back_pressure_and_is_antisymmetric():
    assert engine.through(8.0, 1.0, 0.3) == engine.through(8.0, 2.0, 0.3) == 8.0
    assert engine.through(2.0, 2.0, 0.3) == 0.0
    assert engine.through(2.0, 3.0, 0.3) == -engine.through(3.0, 2.0, 0.3)
    flows = [engine.through(8.0, p, 0.3) for p in np.linspace(1.0, 8.0, 200)]
    assert np.diff(flows).max() <= 0.0


@pytest.mark.parametrize("seed", range(700_000, 700_010))
@pytest.mark.parametrize("ends", [(1.0, 2.0), (2.0, 1.0)])
def test_proportional_valve_reaches_its_setpoint_within_its_gain_error(seed, ends):
    """At constant volume a step of 1 bar reaches 63 % in 0.03 to 0.2 s, without dead time."""
    c, dt = rigs._valve(engine.ORIFICE, np.random.default_rng(seed), {}), 5e-4
    p, spool, total, volume = ends[0], 0.0, 0.0, 1.0 + 0.1 * c[fields.VALVE.index("widening")]
    found = []
    for _ in range(20_000):
        p, spool, total = engine.valve_flow(c, p, spool, total, ends[1], volume, 0.0, dt)
        found.append(p)
    assert found[-1] == pytest.approx(c[3] * ends[1], abs=1e-3)
    part = (np.array(found) - ends[0]) / (ends[1] - ends[0])
    assert 0.03 < dt * np.argmax(part > 0.632) < 0.2
    assert part.max() < 1.1


@pytest.mark.parametrize("seed", range(700_000, 700_005))
def test_cycle_of_pressure_and_length_does_the_work_of_its_air(seed):
    """The area of the cycle in force and length is in proportion to that in pressure and volume."""
    family, random = rigs.FAMILIES["antagonistic_joint"], np.random.default_rng(seed)
    c = rigs._muscles(family, random, {}, engine.POLYNOMIAL)[0]
    over = []
    for low, high in ((-0.05, 0.02), (0.02, 0.08), (0.08, 0.15)):
        middles = low + (high - low) * (np.arange(200) + 0.5) / 200
        given = [engine.polynomial(c, 2.5, e) - engine.polynomial(c, 1.5, e) for e in middles]
        grown = engine.swollen(c, 2.0, high) - engine.swollen(c, 2.0, low)
        over.append((high - low) * np.mean(given) / grown)
    assert over == pytest.approx([over[0]] * 3, rel=1e-3)


def test_set_valued_friction_stops_a_joint_and_never_reverses_it():
    """A speed that the breakaway torque of a step can stop, and a greater one, at either joint."""
    joints = np.zeros((2, len(fields.JOINT)))
    joints[:, 5:8] = 0.04, 0.55, 0.05
    inverse, dt = np.array([[300.0, -200.0], [-200.0, 400.0]]), 5e-4
    mass = np.linalg.inv(inverse)
    for speeds in ([1e-3, -1e-3], [3.0, 1e-4], [-2.0, 2.0]):
        v, push = np.array(speeds), np.zeros(2)
        before = v.copy()
        for _ in range(5):  # from the impulses of the last step
            v = before.copy()
            engine.hold(joints, inverse, before, v, push, dt)
        assert v @ mass @ v < before @ mass @ before
        assert np.abs(push).max() <= 0.04 * dt * (1.0 + 1e-12)
        assert np.all(v * before >= -1e-9)
    v, push = np.array([1e-3, -1e-3]), np.zeros(2)
    engine.hold(joints, inverse, v.copy(), v, push, dt)
    assert np.abs(v).max() < 1e-5


@pytest.mark.parametrize("effect", HIDDEN)
@pytest.mark.parametrize("name", FAMILIES)
def test_hidden_effects_change_the_angles_in_the_polynomial_world(name, effect):
    clean, sheet = record(name, "polynomial", 700_000)
    faulty, _ = record(name, "polynomial", 700_000, HIDDEN[effect])
    change = angles_of(faulty) - angles_of(clean)
    assert np.sqrt(np.mean(change**2)) > 3.0 * min(sheet.noise.values())
    again, _ = record(name, "polynomial", 700_000, HIDDEN[effect])
    assert np.array_equal(angles_of(again), angles_of(faulty))
