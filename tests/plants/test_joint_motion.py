"""The antagonistic joint in motion: independent integration, poles, convergence, bits."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from pam_envs.hysteresis.protocol import kinds
from pam_envs.kernels.build import COMPILED
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rollout import (
    simulate_joint,
)

slow = pytest.mark.skipif(not COMPILED, reason="too many sub-steps for plain Python")
PERIOD = AntagonisticJoint.control_period
MAKES = ("paper", "measured", "reduced")
DEGREE = np.radians(1.0)


def steps(n: int, largest: float, every: int = 10, seed: int = 0) -> np.ndarray:
    drawn = np.random.default_rng(seed).uniform(-largest, largest, -(-n // every))
    return np.repeat(drawn, every)[:n]


def integrated(
    plant: AntagonisticJoint, commands: np.ndarray, payload: float, shove: float
) -> np.ndarray:
    """Angle [rad] of a joint without hysteresis, from an independent form of its equation."""
    muscle, lever, link = plant.muscle, plant.lever, plant.link
    inertia = link.inertia + payload * link.length**2
    moment = link.gravity * (link.mass * link.centre + payload * link.length)

    def derivative(t: float, state: np.ndarray, u: np.ndarray) -> list[float]:
        phi, rate, p = state[0], state[1], state[2:]
        length, arms = lever.length(phi), lever.rate(phi)
        x = 1.0 - length / muscle.rest_length
        braid = muscle.braid_force * (1.0 - np.exp(-x / muscle.stretch / muscle.braid_strain))
        passive = muscle.threshold + braid + muscle.stiffness * x / muscle.stretch
        active = p * muscle.area * (1.0 - muscle.taper * x / muscle.stretch)
        speed = -arms * rate / muscle.rest_length
        forces = np.maximum(0.0, active - passive - muscle.viscosity * p * speed)
        torque = shove - float(forces @ arms) - moment * np.sin(phi) - link.damping * rate
        filling = (u - p) / plant.regulator.time_constant
        return [rate, torque / inertia, *filling.tolist()]

    pressures = np.stack(plant.pressures_for(commands)[:2], axis=-1)
    start = simulate_joint(
        plant, commands[:1], payload=payload, disturbance=shove, quasi_static=True
    )
    state = np.array([start["angle"][0], 0.0, *pressures[0]])
    made = []
    for u in pressures:
        run = solve_ivp(
            derivative, (0.0, PERIOD), state, args=(u,), rtol=1e-9, atol=[1e-11, 1e-10, 1e-4, 1e-4]
        )
        state = run.y[:, -1]
        made.append(state[0])
    return np.array(made)


@pytest.mark.parametrize("payload, shove", [(0.0, 0.0), (0.4, -0.7)])
def test_the_joint_follows_its_differential_equation(payload: float, shove: float) -> None:
    commands = steps(60, 22.0 * DEGREE)
    plant = AntagonisticJoint.paper("none").with_lag_alone()
    made = simulate_joint(plant, commands, payload=payload, disturbance=shove)["angle"]
    exact = integrated(plant, commands, payload, shove)
    assert np.abs(made - exact).max() < 0.02 * DEGREE
    fine = dataclasses.replace(plant, substeps=32)
    made = simulate_joint(fine, commands, payload=payload, disturbance=shove)["angle"]
    assert np.abs(made - exact).max() < 1e-3 * DEGREE


@slow
@pytest.mark.parametrize("kind", kinds())
def test_sub_steps_converge_at_second_order(kind) -> None:  # type: ignore[no-untyped-def]
    """And that of four stays a fifth of the encoder's noise where a muscle turns slack, too."""

    def errors(largest: float, shove: float) -> list[np.ndarray]:
        commands, shoves = steps(80, largest, 8), steps(80, shove, 7, 1)
        made = []
        for n in (100, 4, 8, 16):
            plant = dataclasses.replace(AntagonisticJoint.paper(kind), substeps=n)
            made.append(simulate_joint(plant, commands, disturbance=shoves, payload=0.2)["angle"])
        return [m - made[0] for m in made[1:]]

    rms = [float(np.sqrt(np.mean(e**2))) for e in errors(16.0 * DEGREE, 0.4)]
    assert rms[0] / rms[1] > 3.0 and rms[1] / rms[2] > 3.0
    rough = errors(25.0 * DEGREE, 1.5)[0]
    assert np.sqrt(np.mean(rough**2)) < 0.2 * AntagonisticJoint.paper().angle.noise
    assert np.abs(rough).max() < 0.02 * DEGREE


def double_pole(response: np.ndarray) -> float:
    """The pole [rad/s] of the critically damped step response nearest to a response."""
    t = PERIOD * np.arange(len(response))

    def off(pole: np.ndarray) -> np.ndarray:
        return 1.0 - (1.0 + pole * t) * np.exp(-pole * t) - response

    return float(least_squares(off, [20.0]).x[0])


@pytest.mark.parametrize(
    "start, end", [(0.0, 1.0), (0.0, 10.0), (10.0, 20.0), (20.0, 25.0), (-10.0, 10.0), (20.0, 10.0)]
)
def test_the_nominal_dynamics_are_two_poles_near_23(start: float, end: float) -> None:
    """Without hysteresis and gravity, over the whole range: within 3 rad/s, to 2 % of the step."""
    plant = AntagonisticJoint.paper("none", link__gravity=0.0).with_lag_alone()
    commands = DEGREE * np.array([start] * 2 + [end] * 60)
    angles = simulate_joint(plant, commands)["angle"][1:]
    response = (angles - angles[0]) / (commands[-1] - commands[0])
    pole = double_pole(response)
    assert pole == pytest.approx(23.0, abs=3.0)
    t = PERIOD * np.arange(len(response))
    model = 1.0 - (1.0 + pole * t) * np.exp(-pole * t)
    assert np.sqrt(np.mean((response - model) ** 2)) < 0.02
    assert response[-1] == pytest.approx(1.0, abs=1e-4)


def test_the_reduced_plant_has_the_published_poles() -> None:
    plant = AntagonisticJoint.reduced("none", link__gravity=0.0)
    angles = simulate_joint(plant, DEGREE * np.array([0.0] + [10.0] * 60))["angle"]
    assert double_pole(angles / (10.0 * DEGREE)) == pytest.approx(23.0, abs=1e-6)


@pytest.mark.parametrize("kind", kinds())
def test_reduced_plant_is_near_the_plant_with_muscles(kind) -> None:  # type: ignore[no-untyped-def]
    """Steps and sines within +-20 degrees: about 0.3 degrees RMS; over 1 without hysteresis."""
    t = PERIOD * np.arange(600)
    still = {"link__gravity": 0.0}
    whole, reduced, plain = (
        AntagonisticJoint.paper(kind, **still).with_lag_alone(),
        AntagonisticJoint.reduced(kind, **still),
        AntagonisticJoint.reduced("none", **still),
    )
    for commands in (steps(600, 20.0 * DEGREE, 75, 3), 20.0 * DEGREE * np.sin(np.pi * t)):
        truth = simulate_joint(whole, commands)["angle"]
        off, blind = (
            float(np.sqrt(np.mean((simulate_joint(p, commands)["angle"] - truth) ** 2)))
            for p in (reduced, plain)
        )
        assert 0.1 * DEGREE < off < 0.4 * DEGREE
        assert kind == "none" or blind > 3.0 * off


def test_energy_is_lost_in_free_motion() -> None:
    """No disturbance, held pressures: kinetic and potential energy of muscles and weights fall."""
    plant = AntagonisticJoint.paper("none", link__limit=0.5)
    shoves = np.concatenate([np.full(40, 3.0), np.zeros(60)])
    made = simulate_joint(
        dataclasses.replace(plant, substeps=16), np.zeros(100), disturbance=shoves
    )
    fine = np.linspace(-0.6, 0.6, 4001)
    p_a, p_b = (float(v) for v in plant.pressures_for(0.0)[:2])
    torque = plant.torque(fine, p_a, p_b) - plant.weight_torque(fine)
    stored = -np.concatenate([[0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * np.diff(fine))])
    energy = (
        np.interp(made["angle"], fine, stored) + 0.5 * plant.link.inertia * made["velocity"] ** 2
    )
    assert made["angle"][39] > 8.0 * DEGREE
    assert np.all(np.diff(energy[39:]) < 1e-9)
    assert abs(made["angle"][-1]) < 0.02 * DEGREE


def test_slow_push_and_return_dissipates_work_by_hysteresis() -> None:
    """Viscosity takes work in proportion to the speed, friction the same however slow it is."""
    dry, viscous = {}, {}
    for kind in kinds():
        lost = []
        for periods in (400, 800):
            shoves = 3.0 * np.sin(2.0 * np.pi * np.arange(2 * periods) / periods)
            plant = AntagonisticJoint.paper(kind)
            angle = simulate_joint(plant, np.zeros(2 * periods), disturbance=shoves)["angle"]
            mean = 0.5 * (shoves[periods:] + shoves[periods - 1 : -1])
            lost.append(float(mean @ np.diff(angle[periods - 1 :])))
        dry[kind], viscous[kind] = 2.0 * lost[1] - lost[0], 2.0 * (lost[0] - lost[1])
    assert min(viscous.values()) > 0.0
    assert abs(dry["none"]) < 0.05 * viscous["none"]
    assert dry["maxwell_slip"] > 0.5 * viscous["none"]
    assert dry["preisach"] == pytest.approx(dry["maxwell_slip"], rel=0.05)


def test_heavier_link_keeps_its_shape() -> None:
    light, heavy = (AntagonisticJoint.paper(link__mass=m).link for m in (0.2, 0.4))
    assert heavy.inertia == pytest.approx(2.0 * light.inertia)
    assert AntagonisticJoint.paper().link.inertia == pytest.approx(0.3 * 0.25**2 / 3.0)


def test_a_slack_muscle_has_no_force_and_is_reported() -> None:
    plant = AntagonisticJoint.paper()
    made = simulate_joint(plant, np.zeros(60), pressures=(np.full(60, 6e5), np.zeros(60)))
    assert made["force_b"][-1] == 0.0 and made["slack"][-1] == 1.0
    assert made["force_a"].min() >= 0.0 and made["angle"][-1] > 0.4
    empty = simulate_joint(plant, np.zeros(60), pressures=(np.zeros(60), np.zeros(60)))
    assert empty["slack"][-1] == 2.0 and empty["torque"][-1] == 0.0


def test_the_stop_holds_the_joint() -> None:
    plant = AntagonisticJoint.paper()
    made = simulate_joint(plant, np.zeros(150), disturbance=np.full(150, 20.0))
    assert np.degrees(made["angle"][-1]) == pytest.approx(35.0, abs=2.5)
    assert made["angle"].max() < plant.lever.toggle
    rest = simulate_joint(plant, np.zeros(2), disturbance=20.0, quasi_static=True)["angle"]
    assert made["angle"][-1] == pytest.approx(rest[0], abs=0.1 * DEGREE)


def test_payload_slows_the_joint_and_lowers_its_angle() -> None:
    plant = AntagonisticJoint.paper("none")
    commands = np.concatenate([np.zeros(2), np.full(150, 15.0 * DEGREE)])
    light, heavy = (simulate_joint(plant, commands, payload=m)["angle"] for m in (0.0, 1.0))
    assert heavy[6] < light[6]
    assert heavy[-1] < light[-1] - 0.5 * DEGREE


@pytest.mark.parametrize("make", MAKES)
@pytest.mark.parametrize("kind", kinds())
def test_joint_at_rest_stays_at_rest(make: str, kind) -> None:  # type: ignore[no-untyped-def]
    plant = getattr(AntagonisticJoint, make)(kind)
    made = simulate_joint(plant, np.full(40, 12.0 * DEGREE), payload=0.3, disturbance=0.4)
    assert np.ptp(made["angle"]) < 1e-9 and np.abs(made["velocity"]).max() < 1e-7


@pytest.mark.parametrize("make", ["paper", "reduced"])
@pytest.mark.parametrize("kind", kinds())
def test_slow_commands_reach_the_quasi_static_angles(make: str, kind) -> None:  # type: ignore[no-untyped-def]
    plant = getattr(AntagonisticJoint, make)(kind, link__gravity=0.0)
    commands = DEGREE * np.array([0.0, 15.0, -5.0, 10.0, 2.0])
    held = simulate_joint(plant, np.repeat(commands, 80))["angle"][79::80]
    assert np.allclose(held, plant.rest_angles(commands), atol=0.05 * DEGREE)
