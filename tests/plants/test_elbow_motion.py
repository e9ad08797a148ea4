"""The elbow orthosis in motion: independent integration, air, valves, wearer, convergence, bits."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pam_envs.constants import ATMOSPHERE, PRESSURE_PER_DENSITY
from pam_envs.hysteresis.protocol import kinds
from pam_envs.kernels.build import COMPILED
from pam_envs.plants.elbow_orthosis.plant import MAKES, ElbowOrthosis
from pam_envs.plants.elbow_orthosis.rollout import (
    simulate_elbow,
)
from pam_envs.pneumatics.flow import mass_flow
from pam_envs.pneumatics.on_off_pair import OnOffValve

slow = pytest.mark.skipif(not COMPILED, reason="too many sub-steps for plain Python")
PERIOD = ElbowOrthosis.control_period
Array = np.ndarray
Intent = tuple[Array, Array, Array]


def reach(n: int, frequency: float = 0.5, middle: float = 1.0, swing: float = 0.6) -> Intent:
    """A sine of the wearer's hand: angle [rad], rate and acceleration at the ends of periods."""
    t, w = PERIOD * np.arange(1, n + 1), 2.0 * np.pi * frequency
    angle = middle - swing * np.cos(w * t)
    return angle, swing * w * np.sin(w * t), swing * w * w * np.cos(w * t)


def steps(n: int, low: float, high: float, every: int = 10, seed: int = 0) -> Array:
    drawn = np.random.default_rng(seed).uniform(low, high, (-(-n // every), 2))
    return np.repeat(drawn, every, axis=0)[:n]


def commands_for(plant: ElbowOrthosis, n: int, seed: int = 0) -> Array:
    if plant.valves == "on_off":
        return steps(n, -0.03, 0.05, 5, seed)
    return steps(n, 0.5e5, 5.5e5, 10, seed)


# --- against differential equations written anew -------------------------------------------------


class Model:
    """Forearm and bundles without hysteresis, from their equations."""

    def __init__(self, plant: ElbowOrthosis, intent: Intent) -> None:
        self.plant, self.bundles = plant, (plant.bundle_a, plant.bundle_b)
        wearer, gravity = plant.wearer, plant.link.gravity
        self.own = wearer.mass * wearer.centre * gravity
        q, rate, bend = intent
        held = wearer.stiffness * q + wearer.damping * rate
        drive = held + wearer.inertia * bend + self.own * np.sin(q)
        first = wearer.stiffness * q[0] + self.own * np.sin(q[0])
        self.drive = np.concatenate([[first], drive])
        self.times = PERIOD * np.arange(len(q) + 1)

    def acceleration(self, t: float, q: float, rate: float, p_a: float, p_b: float) -> float:
        plant, link, wearer = self.plant, self.plant.link, self.plant.wearer
        torque = float(plant.torque(q, p_a, p_b)) + float(np.interp(t, self.times, self.drive))
        torque -= (self.own + link.mass * link.centre * link.gravity) * np.sin(q)
        torque -= wearer.stiffness * q + (wearer.damping + link.damping) * rate
        torque -= self.viscous(q, rate, p_a, p_b)
        return torque / (link.inertia + wearer.inertia)

    def viscous(self, q: float, rate: float, p_a: float, p_b: float) -> float:
        """Return the torque [N m] by which the muscles' viscosity resists the motion."""
        muscle, radius, total = self.plant.muscle, self.plant.pulley.radius, 0.0
        forces = self.plant.forces(q, p_a, p_b)
        for bundle, p, force, sign in zip(self.bundles, (p_a, p_b), forces, (-1, 1), strict=True):
            speed = sign * radius * rate
            share = muscle.viscosity_relaxing if speed < 0.0 else 1.0
            drag = muscle.viscosity_per_pressure * p * share
            drag += muscle.viscosity / np.sqrt(1.0 + abs(speed) / muscle.viscosity_speed)
            total += sign * radius * min(float(force), bundle.muscles * drag * speed)
        return total

    def run(self, rate: object, start: list[float]) -> Array:
        made, state = [], np.array(start)
        for k in range(len(self.times) - 1):
            span = self.times[k : k + 2]
            state = solve_ivp(rate, span, state, rtol=1e-8, atol=1e-10, max_step=1e-3).y[:, -1]  # type: ignore[call-overload]
            made.append(state)
        return np.array(made)


VISCOUS = {
    "muscle.viscosity": 600.0,
    "muscle.viscosity_per_pressure": 2e-3,
    "muscle.viscosity_relaxing": 0.5,
}
CORRECTED = {"muscle.map_02": 2.0, "muscle.map_13": -2.0, "muscle.map_20": 3.0}


@pytest.mark.parametrize("changes", [{}, VISCOUS, CORRECTED], ids=["plain", "viscous", "map"])
def test_the_forearm_follows_its_differential_equation(changes: dict[str, float]) -> None:
    plant, n = ElbowOrthosis.paper("none").with_lag_alone().replace(changes), 150
    if changes == VISCOUS:  # the damping is that of the speed before a sub-step
        plant = dataclasses.replace(plant, substeps=40)
    intent, commands = reach(n), steps(n, 0.5e5, 5.5e5, every=25)
    made = simulate_elbow(plant, commands, intent=intent)
    plain = simulate_elbow(plant.replace(plant.neutral), commands, intent=intent)
    assert (np.abs(made["angle"] - plain["angle"]).max() > 5e-3) == bool(changes)
    model = Model(plant, intent)

    def rate(t: float, state: Array) -> list[float]:
        q, v, p_a, p_b = state
        u = commands[min(int(t / PERIOD + 1e-9), n - 1)]
        lag = plant.regulator.time_constant
        bend = model.acceleration(t, q, v, p_a, p_b)
        return [v, bend, (u[0] - p_a) / lag, (u[1] - p_b) / lag]

    rest = simulate_elbow(plant, commands[:1], intent=(intent[0][:1], np.zeros(1), np.zeros(1)))
    truth = model.run(rate, [float(rest["angle"][0]), 0.0, *commands[0]])
    assert np.abs(rest["velocity"][0]) < 1e-9
    assert np.abs(made["angle"] - truth[:, 0]).max() < 5e-5
    assert np.abs(made["pressure_b"] - truth[:, 3]).max() < 1.0


def test_pulses_follow_their_differential_equation() -> None:
    """Valves, flow and enclosed air, moving: a pulse in each cycle, forwards and backwards."""
    plant = ElbowOrthosis.paper("none", "on_off")
    n, valve = 150, plant.valve
    intent, commands = reach(n, frequency=1.0), steps(n, -0.05, 0.05, every=5, seed=3)
    start = (1e5, 3e5)
    made = simulate_elbow(plant, commands, intent=intent, pressures=start)
    model = Model(plant, intent)
    supply = valve.supply_pressure + ATMOSPHERE
    spans = [[open_spans(commands[::5, k] * sign, valve) for sign in (1, -1)] for k in range(2)]

    def rate(t: float, state: Array) -> list[float]:
        q, v, *air = state
        volumes = [
            float(b.volume(c))
            for b, c in zip(model.bundles, plant.pulley.contractions(q), strict=True)
        ]
        pressures = [m * PRESSURE_PER_DENSITY / s for m, s in zip(air, volumes, strict=True)]
        flows = []
        for k, p in enumerate(pressures):
            fill, vent = (any(a <= t < b for a, b in s) for s in spans[k])
            come = mass_flow(supply, p, valve.conductance, valve.critical_ratio) if fill else 0.0
            left = mass_flow(p, ATMOSPHERE, valve.conductance, valve.critical_ratio) if vent else 0
            flows.append(come - left)
        bend = model.acceleration(t, q, v, pressures[0] - ATMOSPHERE, pressures[1] - ATMOSPHERE)
        return [v, bend, *flows]

    rest = simulate_elbow(
        plant, np.zeros((1, 2)), intent=(intent[0][:1], np.zeros(1), np.zeros(1)), pressures=start
    )
    air = [float(rest["air_a"][0]), float(rest["air_b"][0])]
    truth = model.run(rate, [float(rest["angle"][0]), 0.0, *air])
    assert np.abs(made["angle"] - truth[:, 0]).max() < 1e-4
    for k, name in ((2, "air_a"), (3, "air_b")):
        assert np.ptp(truth[:, k]) > 0.05 * truth[0, k]
        assert np.abs(made[name] / truth[:, k] - 1.0).max() < 1e-3


def open_spans(widths: Array, valve: OnOffValve) -> list[tuple[float, float]]:
    """Intervals of an open valve, from the widths of its pulses in cycles of 50 ms."""
    late, after = valve.opening_time, valve.closing_time
    starts = 0.05 * np.arange(len(widths))
    merged: list[list[float]] = []
    for start, width in zip(starts, np.maximum(widths, 0.0), strict=True):
        if merged and start - merged[-1][1] < after and width > 0.0:  # it had not yet closed
            merged[-1][1] = start + width
        elif width > 0.0:
            merged.append([start, start + width])
    return [(a + late, b + after) for a, b in merged if b - a >= late]


# --- convergence ---------------------------------------------------------------------------------


@slow
@pytest.mark.parametrize("valves", MAKES)
@pytest.mark.parametrize("hysteresis", kinds())
def test_integrator_converges_to_a_fine_reference(hysteresis: str, valves: str) -> None:
    """Against 25 and 100 times as many sub-steps; kinks of the hysteresis reduce the order."""
    plant = ElbowOrthosis.paper(hysteresis, valves)  # type: ignore[arg-type]
    commands = commands_for(plant, 400)

    def run(substeps: int) -> dict[str, Array]:
        made = dataclasses.replace(plant, substeps=substeps)
        return simulate_elbow(made, commands, intent=reach(400), pressures=(2e5, 3e5))

    truth = run(100)
    errors = {n: np.abs(run(n)["angle"] - truth["angle"]).max() for n in (1, 2, 4, 8)}
    slope = np.polyfit(np.log(list(errors)), np.log(list(errors.values())), 1)[0]
    least = 1.75 if hysteresis == "none" else 1.3
    assert -slope > least
    assert errors[plant.substeps] < 3e-5
    assert np.abs(run(plant.substeps)["torque"] - truth["torque"]).max() < 1e-3


# --- air -----------------------------------------------------------------------------------------


def test_closed_valves_keep_the_air_mass_while_the_wearer_moves() -> None:
    plant = ElbowOrthosis.paper(valves="on_off")
    made = simulate_elbow(plant, np.zeros((200, 2)), intent=reach(200), pressures=(2e5, 4e5))
    for name in ("air_a", "air_b"):
        assert np.ptp(made[name]) == 0.0
    assert made["used"][-1] == made["switches"][-1] == 0.0
    assert np.ptp(made["angle"]) > 0.8
    for side, bundle in (("a", plant.bundle_a), ("b", plant.bundle_b)):
        volume = bundle.volume(made[f"contraction_{side}"])
        product = (made[f"pressure_{side}"] + ATMOSPHERE) * volume
        assert product == pytest.approx(PRESSURE_PER_DENSITY * made[f"air_{side}"], rel=1e-12)
        assert np.ptp(made[f"pressure_{side}"]) > 1e4


def test_air_used_equals_air_inside_and_air_exhausted() -> None:
    plant = ElbowOrthosis.paper(valves="on_off")
    commands = np.repeat([[0.04, 0.05], [0.0, 0.0], [0.0, -0.05]], 40, axis=0)
    made = simulate_elbow(plant, commands, intent=reach(120))
    start = simulate_elbow(plant, np.zeros((1, 2)), intent=float(reach(1)[0][0]))
    inside = made["air_a"] + made["air_b"] - start["air_a"] - start["air_b"]
    assert made["used"][:79] == pytest.approx(inside[:79], rel=1e-9)
    assert np.ptp(made["used"][50:]) == 0.0
    assert inside[-1] < 0.95 * made["used"][-1]
    assert np.all(np.diff(made["used"]) >= 0.0)


def test_pulses_are_latched_and_counted_once_a_cycle() -> None:
    plant = ElbowOrthosis.paper(valves="on_off")
    commands = np.tile([0.02, 0.01], (50, 1))
    made = simulate_elbow(plant, commands)
    assert made["switches"][[0, 4, 5, -1]].tolist() == [2.0, 2.0, 4.0, 20.0]
    late = commands.copy()
    late[1:5] = 0.05  # within a cycle nobody looks
    assert np.array_equal(simulate_elbow(plant, late)["air_b"][:5], made["air_b"][:5])
    held = simulate_elbow(plant, np.tile([0.05, 0.0], (50, 1)))
    assert held["switches"][-1] == 1.0


def test_pulses_shorter_than_the_opening_time_have_no_effect() -> None:
    plant = ElbowOrthosis.paper(valves="on_off")
    made = simulate_elbow(plant, np.full((50, 2), 0.0049))
    assert made["used"][-1] == 0.0
    assert made["switches"][-1] == 20.0
    assert simulate_elbow(plant, np.full((50, 2), 0.0051))["used"][-1] > 0.0


def test_enclosed_air_stiffens_the_joint() -> None:
    """A push on the forearm moves it less far with shut valves than with regulators that hold."""
    push = np.repeat([0.0, 5.0], 100)
    moved = []
    for valves, still in (("proportional", 5e5), ("on_off", 0.0)):
        plant = ElbowOrthosis.paper("none", valves)  # type: ignore[arg-type]
        made = simulate_elbow(
            plant, np.full((200, 2), still), disturbance=push, pressures=(5e5, 5e5)
        )
        moved.append(made["angle"][-1] - made["angle"][99])
    plant = ElbowOrthosis.paper("none")
    angle = made["angle"][99]
    level = plant.wearer.mass * plant.wearer.centre + plant.link.mass * plant.link.centre
    weight = level * plant.link.gravity * np.cos(angle)
    hold = plant.wearer.stiffness + weight + float(plant.stiffness(angle, 5e5, 5e5))
    assert moved[0] == pytest.approx(5.0 / hold, rel=0.02)
    assert 0.8 * moved[0] < moved[1] < 0.97 * moved[0]


def test_regulators_reach_their_set_points_and_count_what_they_fill() -> None:
    plant = ElbowOrthosis.paper()
    commands = np.repeat([[1e5, 2e5], [4e5, 9e5]], 80, axis=0)
    made = simulate_elbow(plant, commands)
    assert made["pressure_a"][[79, -1]] == pytest.approx([1e5, 4e5], rel=1e-3)
    assert made["pressure_b"][[79, -1]] == pytest.approx([2e5, 6e5], rel=1e-3)
    inside = made["air_a"] + made["air_b"]
    assert made["used"][-1] - made["used"][79] == pytest.approx(inside[-1] - inside[79], rel=0.01)
    rise = np.diff(made["pressure_b"][79:90]) / PERIOD
    assert rise.max() == pytest.approx(plant.regulator.slew_rate, rel=1e-6)


# --- wearer, hysteresis, slack -------------------------------------------------------------------


def test_self_supporting_orthosis_leaves_the_intended_motion_unchanged() -> None:
    """Pressures that bear it at every angle: the intended motion is carried out."""
    plant = ElbowOrthosis.paper(
        "none", link__damping=0.0, link__inertia=1e-4, regulator__time_constant=2e-3
    ).with_lag_alone()
    intent = reach(200)
    pressures = np.array(plant.allocate(intent[0], plant.weight_torque(intent[0]), 4.0)).T
    borne = simulate_elbow(plant, pressures, intent=intent)
    held = simulate_elbow(plant, np.tile(pressures[0], (200, 1)), intent=intent)
    assert np.ptp(borne["angle"]) > 0.5
    assert np.abs(borne["angle"] - intent[0])[5:].max() < 0.01
    assert np.abs(borne["felt"])[5:].max() < 0.2
    assert np.abs(held["felt"]).max() > 1.0


@pytest.mark.parametrize(
    ("plants", "commands", "how", "words"),
    [
        (1, np.zeros(5), {}, "commands have shape"),
        (1, np.zeros((5, 3)), {}, "commands have shape"),
        (1, np.zeros((0, 2)), {}, "one or more periods"),
        (1, np.full((5, 2), np.nan), {}, "not finite"),
        (0, np.zeros((5, 2)), {}, "no plants"),
        (2, np.zeros((5, 3, 2)), {}, "for 3 plants and 2"),
        (1, np.zeros((5, 2)), {"intent": np.ones(4)}, "intent has shape"),
    ],
)
def test_shapes_that_do_not_fit_are_refused(
    plants: int, commands: np.ndarray, how: dict[str, np.ndarray], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        simulate_elbow([ElbowOrthosis.paper()] * plants, commands, **how)  # type: ignore[arg-type]


def test_interaction_torque_balances_the_wearer() -> None:
    """At rest the wearer's muscles carry what he feels, beyond the weight of his own arm."""
    plant = ElbowOrthosis.paper()
    made = simulate_elbow(plant, np.tile([1e5, 3e5], (300, 1)), intent=1.0)
    own = plant.wearer.mass * plant.wearer.centre * plant.link.gravity
    carried = own * (np.sin(made["angle"][-1]) - np.sin(1.0))
    assert made["felt"][-1] == pytest.approx(carried - made["wearer"][-1], abs=1e-6)
    weight = float(plant.weight_torque(made["angle"][-1]))
    assert made["felt"][-1] == pytest.approx(made["torque"][-1] - weight, abs=1e-6)


def test_interaction_torque_moves_the_forearm() -> None:
    """Newton's law of the forearm alone, in motion."""
    plant = ElbowOrthosis.paper("none", regulator__slew_rate=1e9)
    intent = reach(300, frequency=0.8)
    made = simulate_elbow(dataclasses.replace(plant, substeps=16), steps(300, 1e5, 3e5, 100),
                          intent=intent)  # fmt: skip
    wearer, q = plant.wearer, made["angle"]
    bend = np.gradient(made["velocity"], PERIOD)
    own = wearer.mass * wearer.centre * plant.link.gravity * (np.sin(intent[0]) - np.sin(q))
    balance = wearer.inertia * (intent[2] - bend) + made["wearer"] + own + made["felt"]
    quiet = np.ones(300, bool)
    for start in (0, 100, 200):  # where setpoints jump the differences do not hold
        quiet[max(0, start - 2) : start + 15] = False
    quiet[-2:] = False
    assert np.abs(balance[quiet]).max() < 0.01
    assert np.ptp(made["felt"]) > 1.0


@pytest.mark.parametrize("hysteresis", ["maxwell_slip", "preisach"])
def test_friction_dissipates_work_in_a_cycle_only_with_hysteresis(hysteresis: str) -> None:
    lost = []
    for kind in ("none", hysteresis):
        plant = ElbowOrthosis.paper(kind)  # type: ignore[arg-type]
        made = simulate_elbow(plant, np.full((600, 2), 3e5), intent=reach(600))
        cycle = slice(200, 400)
        work = made["torque"][cycle] * made["velocity"][cycle]
        lost.append(-float(work.sum()) * PERIOD)
    assert abs(lost[0]) < 0.02
    assert 0.5 < lost[1] < 3.0


def test_loops_are_as_published_in_motion_led_by_the_wearer() -> None:
    """Force against contraction at 500 kPa, over the whole range: 7.5 % between the branches."""
    plant = ElbowOrthosis.paper(wearer__stiffness=200.0, wearer__damping=10.0, link__gravity=0.0)
    n = 1600
    intent = reach(n, frequency=0.125, middle=np.radians(60.0), swing=np.radians(65.0))
    made = simulate_elbow(plant, np.full((n, 2), 5e5), intent=intent)
    up = slice(801, 1200)
    down = slice(1201, 1600)
    c = np.linspace(0.005, 0.06, 23)
    rise = np.interp(c, made["contraction_b"][up], made["force_b"][up])
    fall = np.interp(c, made["contraction_b"][down][::-1], made["force_b"][down][::-1])
    full = float(plant.bundle_b.law(5e5, 0.0))
    assert 100.0 * (fall - rise).max() / full == pytest.approx(7.5, abs=0.1)


def test_a_bundle_beyond_its_reach_is_slack_and_never_pushes() -> None:
    """Muscles that end at 17 % of contraction: friction slackens them before."""
    plant = ElbowOrthosis.paper(
        bundle_b__largest_contraction=0.17, wearer__stiffness=200.0, wearer__damping=8.0
    )
    intent = reach(400, frequency=0.25, middle=1.4, swing=0.75)
    made = simulate_elbow(plant, np.full((400, 2), 1e5), intent=intent)
    assert made["force_b"].min() == 0.0
    assert made["force_a"].min() > 0.0
    assert np.array_equal(made["slack"], np.where(made["force_b"] > 0.0, 0.0, 1.0))
    assert set(made["slack"]) == {0.0, 1.0}


@pytest.mark.parametrize("counts", [(1, 1), (2, 9), (12, 6)])
@pytest.mark.parametrize("valves", MAKES)
def test_bundles_of_any_number_of_muscles_can_be_simulated(
    counts: tuple[int, int], valves: str
) -> None:
    a, b = counts
    plant = ElbowOrthosis.paper(valves=valves, bundle_a__muscles=a, bundle_b__muscles=b)  # type: ignore[arg-type]
    made = simulate_elbow(plant, commands_for(plant, 60), intent=reach(60), pressures=(2e5, 2e5))
    assert all(np.isfinite(v).all() for v in made.values())
    assert np.abs(made["angle"] - reach(60)[0]).max() < 0.7
    law = plant.stiffness(made["angle"], made["pressure_a"], made["pressure_b"])
    assert made["stiffness"] == pytest.approx(law, rel=1e-9)


def test_stops_hold_the_elbow_in_its_range() -> None:
    plant = ElbowOrthosis.paper()
    for force, intended in ((20.0, 2.0), (-20.0, 0.1)):
        made = simulate_elbow(
            plant, np.tile([0.0, 0.0], (200, 1)), intent=intended, disturbance=force
        )
        low, high = plant.hard_limits
        assert low < made["angle"][-1] < high
