"""Flow of air through a regulator's orifices: balance of mass, filling, trapped air, refusals."""

import dataclasses
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.trapped_air import CONTRACTION, EXPONENTS, shut_joint, trapped_air
from pam_envs.constants import ATMOSPHERE, PRESSURE_PER_DENSITY, REFERENCE_DENSITY
from pam_envs.data.stick_slip import load_stick_slip, log_slopes
from pam_envs.kernels.build import COMPILED
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rollout import simulate_joint
from pam_envs.plants.core.rollout import drives_of, run
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.plants.elbow_orthosis.rollout import simulate_elbow
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.knee_orthosis.rollout import simulate_knee
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.redundant_manipulator.rollout import simulate_manipulator
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.rollout import loop_of, simulate
from pam_envs.pneumatics.flow import REPLACED, SWITCH, inflow, mass_flow, power_of_ratio
from tests.envs.cases import IDS

FLOW = {SWITCH: 1.0}
PERIOD = 0.01
BEFORE, AFTER = 60, 100
"""Control periods with the valve at work, and with it shut."""
Pair = tuple[Any, Any]
MAKES: dict[str, Callable[..., Any]] = {
    "single_muscle": SingleMuscle.mas10,
    "antagonistic_joint": AntagonisticJoint.paper,
    "redundant_manipulator": RedundantManipulator.paper,
    "knee_orthosis": KneeOrthosis.no_load,
    "elbow_orthosis": ElbowOrthosis.paper,
}
EVERY = pytest.mark.parametrize("name", MAKES)


def shut(pressure: float) -> Any:
    return np.r_[np.full(BEFORE, pressure), np.full(AFTER, -1.0)]


def swing(amplitude: float) -> Any:
    return np.r_[np.zeros(BEFORE), amplitude * np.sin(0.1 * np.arange(AFTER))]


def lift(plant: SingleMuscle, pressure: Any, load: Any) -> dict[str, Any]:
    """Return contraction [m] and pressure [Pa] under setpoints and loads, one a period."""
    drives = drives_of([pressure, load, plant.muscle.temperature, 0.0, 0.0])
    made = run(loop_of(plant, True), plant, plant.parameter_rows()[None], drives, compiled=False)
    return {"contraction": made[0, :, 0], "pressure": made[2, :, 0]}


def muscle(plant: SingleMuscle) -> Pair:
    law, load = plant.muscle, plant.mass.load
    made = lift(plant, shut(3e5), load + 0.5 + swing(0.5))
    begun = float(plant._absolute(np.zeros(()), np.asarray(load + 0.5)))
    return made["pressure"], law.volume_at((made["contraction"] + begun) / law.rest_length)


def joint(plant: AntagonisticJoint) -> Pair:
    held = shut(3e5)
    made = simulate_joint(plant, pressures=(held, held), disturbance=swing(1.5), compiled=False)
    return made["pressure_a"], plant.muscle.volume_at(made["contraction_a"])


def arm(plant: RedundantManipulator) -> Pair:
    commands = np.zeros((BEFORE + AFTER, plant.stages))
    torques = swing(1.0)[:, None] * np.ones(plant.stages)
    shaken = simulate_manipulator(plant, commands, disturbance=torques, compiled=False)
    return shaken["pressure"], plant.muscle.volume_at(shaken["contraction"])


def knee(plant: KneeOrthosis) -> Pair:
    leg = dataclasses.replace(plant, mounting="leg").replace(
        {"lever.mount_angle": KneeOrthosis.on_leg().lever.mount_angle, "stride.time": 1.3}
    )
    made = simulate_knee(leg, shut(2e5), compiled=False)
    return made["pressure"], plant.muscle.volume_at(made["length"])


def elbow(plant: ElbowOrthosis) -> Pair:
    commands = np.stack([shut(1e5), shut(3e5)], axis=1)
    made = simulate_elbow(plant, commands, disturbance=swing(2.0), compiled=False)
    volume = made["air_b"] * PRESSURE_PER_DENSITY / (made["pressure_b"] + ATMOSPHERE)
    return made["pressure_b"], volume


SHUT: dict[str, Callable[[Any], Pair]] = {
    "single_muscle": muscle,
    "antagonistic_joint": joint,
    "knee_orthosis": knee,
    "elbow_orthosis": elbow,
}


# --- the orifice -----------------------------------------------------------------------------


def test_power_of_ratio_is_accurate_within_a_quarter() -> None:
    ratios = np.linspace(0.8, 1.25, 91)
    for exponent in (0.1, 0.2, 0.4):
        found = [power_of_ratio(float(r), exponent) for r in ratios]
        np.testing.assert_allclose(found, ratios**exponent, rtol=2e-11)


@pytest.mark.parametrize("critical", [0.0, 0.3, 0.6])
def test_inflow_is_the_mass_flow_of_either_orifice(critical: float) -> None:
    source, size, share = 8e5, 2e-10, 0.5
    sizes = (size, share * size, critical, 1.0 / (1.0 - critical))
    for p in np.linspace(0.0, 6.9e5, 40):
        filling = mass_flow(source, p + ATMOSPHERE, size, critical)
        assert inflow(1.0, p, source, *sizes) == pytest.approx(filling, rel=1e-12)
        emptying = mass_flow(p + ATMOSPHERE, ATMOSPHERE, share * size, critical)
        assert inflow(-0.5, p, source, *sizes) == pytest.approx(-0.5 * emptying, rel=1e-12)
    assert inflow(1.0, 7.1e5, source, *sizes) == 0.0
    assert inflow(-1.0, -1e4, source, *sizes) == 0.0


def rates(plant: KneeOrthosis, set_point: float, volume: float) -> Callable[..., Any]:
    """Return the rates of a chamber's pressure [Pa], of the integral part [Pa] and of the opening.

    By ISO 6358 and with a bounded PI controller, written out beside the kernels.
    """
    air = plant.regulator

    def flow(up: float, down: float, size: float) -> float:
        ratio = max(down / up, air.critical_ratio)
        part = (ratio - air.critical_ratio) / (1.0 - air.critical_ratio)
        return size * REFERENCE_DENSITY * up * float(np.sqrt(max(0.0, 1.0 - part**2)))

    def rate(_: float, state: Any) -> list[float]:
        p, gathered, spool = state
        error, band = set_point - p, air.opening_band
        wish = float(np.clip((error + gathered) / band, -1.0, 1.0))
        opened = spool if air.opening_lag else wish
        inside = p + ATMOSPHERE
        if opened > 0.0:
            mass = opened * flow(air.source_pressure + ATMOSPHERE, inside, air.conductance)
        else:
            mass = opened * flow(inside, ATMOSPHERE, air.conductance * air.exhaust_share)
        bound = air.opening_windup * band
        full = abs(error + gathered) >= band and (error + gathered) * error > 0.0
        ends = abs(gathered) >= bound and gathered * error > 0.0
        grows = 0.0 if full or ends else air.opening_integral * error
        turns = (wish - spool) / air.opening_lag if air.opening_lag else 0.0
        return [PRESSURE_PER_DENSITY * mass / volume, grows, turns]

    return rate


CONTROLS = (
    {},
    {"regulator.opening_integral": 4.0},
    {"regulator.opening_integral": 8.0, "regulator.opening_windup": 0.1},
    {"regulator.opening_lag": 0.04},
    {"regulator.opening_integral": 4.0, "regulator.opening_lag": 0.02},
)


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize(("start", "set_point"), [(0.0, 4e5), (4e5, 0.5e5), (2e5, 2.2e5)])
def test_held_muscle_fills_and_empties_as_iso_6358_states(
    start: float, set_point: float, control: dict[str, float]
) -> None:
    plant = dataclasses.replace(KneeOrthosis.rig("none"), substeps=8 if control else 4)
    plant = plant.with_lag_alone().with_air("flow")
    plant = plant.replace({"regulator.exhaust_share": 0.6, **control})
    made = simulate_knee(plant, np.full(150, set_point), pressure=start, compiled=False)
    volume = float(plant.muscle.volume_at(plant.fixture.length))
    times = PERIOD * np.arange(1, 151)
    exact = solve_ivp(
        rates(plant, set_point, volume), (0.0, times[-1]), [start, 0.0, 0.0], "LSODA", times,
        rtol=1e-9, atol=1e-6, max_step=1e-3,
    )  # fmt: skip
    np.testing.assert_allclose(made["pressure"], exact.y[0], atol=300.0 if control else 60.0)


@pytest.mark.parametrize("dead", [0.0, 3e3])
def test_integral_part_removes_the_error_of_a_leak(dead: float) -> None:
    plant = KneeOrthosis.rig("none").with_lag_alone().with_air("flow")
    plant = plant.replace({"regulator.leak": 0.5, "regulator.dead_band": dead})
    left = []
    for control in ({}, {"regulator.opening_integral": 4.0}):
        made = simulate_knee(plant.replace(control), np.full(400, 3e5), compiled=False)
        left.append(3e5 - made["pressure"][-100:])
    assert np.min(left[0]) > 1.5e3 + dead
    lost = 0.5 * PERIOD / plant.substeps * 3e5  # by the leak in a sub-step
    most = 2.0 * lost if dead else lost  # at the edge of the dead band, the valve opens and shuts
    assert np.abs(left[1] - dead).max() < most


def test_lane_keeps_its_bits_beside_a_controlled_valve() -> None:
    plain = SingleMuscle.mas10(mass__load=1.0).replace(FLOW)
    other = plain.replace({"regulator.opening_integral": 4.0, "regulator.opening_lag": 0.01})
    command = np.r_[np.full(20, 3e5), np.full(30, 1e5), np.full(10, -1.0)]
    for pair in ([plain, other], [other, plain]):
        together = simulate(pair, command)["pressure"]
        for k, plant in enumerate(pair):
            assert np.array_equal(together[:, k], simulate(plant, command)["pressure"])


def test_flow_into_a_moving_muscle_balances_its_mass() -> None:
    plant = dataclasses.replace(AntagonisticJoint.paper("none").with_air("flow"), substeps=40)
    plant = plant.replace({"regulator.dead_time": 0.0})
    held, raised = np.full(60, 2e5), np.r_[np.full(20, 2e5), np.full(40, 4e5)]
    made = simulate_joint(plant, pressures=(raised, held), compiled=False)
    p, air = made["pressure_a"][21:31], plant.regulator
    mass = (p + ATMOSPHERE) * plant.muscle.volume_at(made["contraction_a"][21:31])
    source = air.source_pressure + ATMOSPHERE
    flow = [mass_flow(source, v + ATMOSPHERE, air.conductance, air.critical_ratio) for v in p]
    come = PERIOD * PRESSURE_PER_DENSITY * 0.5 * (np.array(flow[1:]) + flow[:-1])
    np.testing.assert_allclose(np.diff(mass), come, rtol=2e-4)


def test_a_late_setpoint_takes_effect_within_a_sub_step() -> None:
    plant = KneeOrthosis.rig("none").with_lag_alone().with_air("flow")
    late = plant.replace({"regulator.dead_time": 0.0237})
    raised = np.r_[np.full(5, 1e5), np.full(20, 3e5)]
    found = [
        simulate_knee(p, raised, pressure=1e5, compiled=False)["pressure"] for p in (plant, late)
    ]
    rate = found[0][5] - found[0][4]
    passed = np.interp(PERIOD * np.arange(25) - 0.0237, PERIOD * np.arange(25), found[0])
    np.testing.assert_allclose(found[1][8:20], passed[8:20], atol=0.02 * rate)


# --- air that is shut in ---------------------------------------------------------------------


@pytest.mark.parametrize("exponent", [1.0, 1.3])
@pytest.mark.parametrize("name", SHUT)
def test_shut_valve_keeps_the_air_while_the_muscle_moves(name: str, exponent: float) -> None:
    plant = MAKES[name]("none").replace({**FLOW, "regulator.polytropic": exponent})
    pressure, volume = (np.asarray(v)[BEFORE + 20 :] for v in SHUT[name](plant))
    kept = (pressure + ATMOSPHERE) * volume**exponent
    assert np.ptp(volume) > 3e-3 * volume.mean()
    np.testing.assert_allclose(kept, kept[0], rtol=1e-9)


def test_every_muscle_of_an_arm_balances_its_air() -> None:
    plant = RedundantManipulator.paper("none").replace({**FLOW, "regulator.dead_band": 3e5})
    pressure, volume = arm(plant)
    kept = (pressure + ATMOSPHERE) * volume
    assert np.ptp(pressure, axis=0).min() > 100.0
    np.testing.assert_allclose(kept, np.broadcast_to(kept[0], kept.shape), rtol=1e-9)


def test_leak_empties_a_shut_muscle() -> None:
    plant = MAKES["knee_orthosis"]("none").replace({**FLOW, "regulator.leak": 0.5})
    rig = dataclasses.replace(plant, mounting="rig")
    pressure = simulate_knee(rig, shut(2e5), pressure=2e5, compiled=False)["pressure"]
    assert pressure[-1] == pytest.approx(pressure[99] * np.exp(-0.5 * PERIOD * 60), rel=1e-6)


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_shut_joint_is_stiffer_by_its_air(exponent: float) -> None:
    plant = shut_joint(exponent).replace({"link.damping": 0.5})  # comes to rest
    held, torque = shut(5e5), np.r_[np.zeros(BEFORE + 20), np.full(AFTER - 20, 0.1)]
    made = simulate_joint(plant, pressures=(held, held), disturbance=torque, compiled=False)
    x = plant.lever.contraction(0.0, plant.muscle.rest_length)
    volume, gives = plant.volumes(0.0)
    p = float(made["pressure_a"][BEFORE + 10]) + ATMOSPHERE
    air = float(np.sum(exponent * p * gives**2 / volume))
    law = float(plant.stiffness(0.0, p - ATMOSPHERE, p - ATMOSPHERE))
    assert x == pytest.approx(CONTRACTION) and air > 0.2 * law
    assert 0.1 / made["angle"][-1] == pytest.approx(law + air, rel=0.01)


def test_record_of_shut_valves_is_read_in_si() -> None:
    record = load_stick_slip()
    assert len(record.time) == 7007 and record.time[-1] == pytest.approx(28.024)
    assert record.pressures.mean(axis=1) == pytest.approx([366.67e3, 365.77e3], rel=1e-4)
    slopes = np.polyfit(record.displacement, record.pressures.T, 1)[0]
    assert slopes == pytest.approx([-11.558e6, 11.571e6], rel=1e-3)
    assert record.trapped_slopes() == pytest.approx([-24.69, 24.78], abs=0.01)


def test_measured_compression_lies_between_isothermal_and_adiabatic_air() -> None:
    measured = np.abs(load_stick_slip().trapped_slopes())
    moved = {n: np.abs(log_slopes(*trapped_air(n))) for n in EXPONENTS}
    assert np.all(moved[1.0] < measured) and np.all(measured < moved[1.4])
    np.testing.assert_allclose(moved[1.2], measured, rtol=0.05)
    muscle = shut_joint(1.0).muscle
    expected = float(muscle.area_at(CONTRACTION) / muscle.volume_at(CONTRACTION))
    np.testing.assert_allclose(moved[1.0], expected, rtol=2e-3)


# --- numerics --------------------------------------------------------------------------------


def travelled(name: str, substeps: int) -> Any:
    """Return pressure and motion of a plant over a rise, a fall and a shut valve."""
    plant = dataclasses.replace(MAKES[name]("none").with_air("flow"), substeps=substeps)
    plant = plant.replace({"regulator.dead_time": 0.0})
    command = np.r_[np.full(5, 1.5e5), np.full(25, 3e5), np.full(20, 1e5), np.full(20, -1.0)]
    if name == "single_muscle":
        made = lift(plant, command, 1.0)
        return np.array([made["pressure"] / 1e5, made["contraction"] / 1e-3])
    if name == "knee_orthosis":
        made = simulate_knee(plant, command, pressure=1e5, compiled=False)
        return np.array([made["pressure"] / 1e5, made["angle"] / 0.1])
    if name == "elbow_orthosis":
        commands = np.stack([np.full(70, 1e5), command], axis=1)
        made = simulate_elbow(plant, commands, compiled=False)
        return np.array([made["pressure_b"] / 1e5, made["angle"] / 0.1])
    made = simulate_joint(plant, pressures=(command, np.full(70, 2e5)), compiled=False)
    return np.array([made["pressure_a"] / 1e5, made["angle"] / 0.1])


@pytest.mark.parametrize("name", SHUT)
def test_flow_converges_with_the_square_of_the_sub_step(name: str) -> None:
    fine = travelled(name, 96)
    coarse, half, last = (np.sqrt(np.mean((travelled(name, n) - fine) ** 2)) for n in (4, 8, 32))
    assert coarse < 4e-4 and coarse > 2.8 * half and coarse > 40.0 * last


@EVERY
def test_flow_that_is_off_changes_nothing(name: str) -> None:
    plant = MAKES[name]("maxwell_slip_length")
    other = plant.replace({"regulator.conductance": 5e-10, "regulator.polytropic": 1.3})
    assert not other.extended and other.digest() == plant.digest()
    assert plant.air == "regulator" and plant.with_air("regulator").digest() == plant.digest()
    flowing = plant.with_air("flow")
    assert flowing.air == "flow" and flowing.extended and flowing.digest() != plant.digest()
    assert flowing.replace({"regulator.conductance": 5e-10}).digest() != flowing.digest()


@EVERY
def test_file_keeps_the_orifices(name: str, tmp_path: Path) -> None:
    plant = MAKES[name]("maxwell_slip_length").with_air("flow")
    plant = plant.replace({"regulator.exhaust_share": 0.7})
    plant.to_yaml(tmp_path / "plant.yaml")
    assert "regulator.polytropic" in (tmp_path / "plant.yaml").read_text()
    assert type(plant).from_yaml(tmp_path / "plant.yaml").digest() == plant.digest()


def test_plants_with_and_without_flow_run_side_by_side() -> None:
    plants = [SingleMuscle.mas10(mass__load=1.0).replace(c) for c in ({}, FLOW, {}, FLOW)]
    plants[3] = plants[3].replace({"regulator.conductance": 6e-11, "regulator.leak": 0.2})
    command = np.r_[np.full(20, 3e5), np.full(30, 1e5)]
    together = simulate(plants, command)
    for k, plant in enumerate(plants):
        np.testing.assert_allclose(together["pressure"][:, k], simulate(plant, command)["pressure"])


@pytest.mark.skipif(not COMPILED, reason="needs the compiler")
def test_compiled_flow_has_the_bits_of_plain_python() -> None:
    plant = AntagonisticJoint.paper().with_air("flow").replace({"regulator.polytropic": 1.2})
    command = (shut(3e5), np.full(BEFORE + AFTER, 2e5))
    fast, slow = (simulate_joint(plant, pressures=command, compiled=c) for c in (True, False))
    assert all(np.array_equal(fast[k], slow[k]) for k in fast)


# --- refusals and environments ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("plant", "remedy"),
    [
        (AntagonisticJoint.reduced(), "dynamics = 'muscles'"),
        (KneeOrthosis.rig(dynamics="measured"), "'lag'"),
        (ElbowOrthosis.paper(valves="on_off"), "regulator.flow at 0"),
    ],
)
def test_variants_without_orifices_refuse_flow(plant: Any, remedy: str) -> None:
    with pytest.raises(ValueError, match="air = 'flow'") as refused:
        plant.replace(FLOW)
    assert remedy in str(refused.value)


def test_air_compressed_beyond_the_setpoints_stiffens_the_knee() -> None:
    leg = dataclasses.replace(KneeOrthosis.no_load("none").with_air("flow"), mounting="leg")
    mounted = KneeOrthosis.on_leg().lever.mount_angle
    plant = leg.replace({"lever.mount_angle": mounted, "stride.time": 1.3})
    made, law = simulate_knee(plant, shut(4.4e5), compiled=False), plant.muscle
    assert made["pressure"].max() > 1.3 * plant.regulator.max_pressure
    slope = law.gain * law.stiffness_ratio * made["pressure"]
    np.testing.assert_allclose(made["tension"], slope * (made["length"] - law.shortest_length))


@pytest.mark.parametrize("name", REPLACED[:4])
def test_effects_that_orifices_replace_are_refused(name: str) -> None:
    plant = SingleMuscle.mas10()
    value = 0.5 if plant.neutral[f"regulator.{name}"] == 0.0 else 2.0
    with pytest.raises(ValueError, match=f"regulator.{name} = .* has no effect with air = 'flow'"):
        plant.replace({f"regulator.{name}": value, **FLOW})


def test_source_below_the_largest_setpoint_is_refused() -> None:
    with pytest.raises(ValueError, match=r"source_pressure = 500000 Pa must be above .* 600000 Pa"):
        SingleMuscle.mas10().replace({"regulator.source_pressure": 5e5, **FLOW})


def test_supply_droops_with_what_flows() -> None:
    plant = SingleMuscle.mas10().with_air("flow")
    fill = np.full(80, 6e5)
    ample, poor = (
        simulate(plant.replace({"regulator.supply_droop": droop}), fill)["pressure"]
        for droop in (0.0, 0.5)
    )
    assert poor[-1] < ample[-1] - 5e4


@pytest.mark.parametrize("randomize", [True, "everyday"])
@pytest.mark.parametrize("name", IDS)
def test_environment_draws_what_has_an_effect(name: str, randomize: Any) -> None:
    for hysteresis, drive in product(("maxwell_slip", "preisach"), ("length", "pressure")):
        chosen = {"hysteresis": hysteresis, "hysteresis_drive": drive, "randomize": randomize}
        env = gym.make(name, air="flow", **chosen).unwrapped
        assert env.setup.drawn and env.plant.air == "flow"
    for air, other in (("flow", "time_constant"), ("regulator", "conductance")):
        with pytest.raises(ValueError, match=f"regulator.{other}' has no effect on this plant"):
            gym.make(name, air=air, randomize={f"regulator.{other}": (0.1, 0.2)})


def test_switch_is_on_or_off() -> None:
    with pytest.raises(ValueError, match=r"regulator.flow = 0.5 must be 0 .* or 1"):
        SingleMuscle.mas10().replace({SWITCH: 0.5})
    with pytest.raises(ValueError, match="air = 'vacuum'; choose one of regulator, flow"):
        SingleMuscle.mas10().with_air("vacuum")


def test_on_off_valves_always_flow() -> None:
    plant = ElbowOrthosis.paper(valves="on_off")
    assert plant.air == "flow" and plant.with_air("flow") is plant
    with pytest.raises(ValueError, match="valves = 'proportional'"):
        plant.with_air("regulator")
    with pytest.raises(ValueError, match="air = 'regulator'"):
        gym.make("PAM/ElbowOrthosis-v0", valves="on_off", air="regulator")
    gym.make("PAM/ElbowOrthosis-v0", valves="on_off", air="flow")


@pytest.mark.parametrize("name", IDS)
def test_environment_takes_air(name: str) -> None:
    made = {air: gym.make(name, air=air).unwrapped for air in ("regulator", "flow")}
    assert all(env.plant.air == air for air, env in made.items())
    seen = {}
    for air, env in made.items():
        env.reset(seed=1)
        rng = np.random.default_rng(0)
        actions = rng.uniform(-1.0, 1.0, (15, *env.action_space.shape)).astype(np.float32)
        seen[air] = np.array([env.step(action)[0] for action in actions])
    assert np.isfinite(seen["flow"]).all() and not np.array_equal(seen["flow"], seen["regulator"])
    with pytest.raises(ValueError, match=r"air = 'foam'.* 'regulator', 'flow'"):
        gym.make(name, air="foam")
    with pytest.raises(ValueError, match=r"'regulator.flow' is not a parameter that can be drawn"):
        gym.make(name, randomize={SWITCH: (0.0, 1.0)})
    size = made["flow"].plant.value("regulator.conductance")
    gym.make(name, air="flow", randomize={"regulator.conductance": (0.5 * size, 2.0 * size)})


def test_environment_keeps_the_air_of_its_plant() -> None:
    plant = SingleMuscle.mas10().with_air("flow")
    assert gym.make("PAM/MusclePositioning-v0", plant=plant).unwrapped.plant.air == "flow"
    off = gym.make("PAM/MusclePositioning-v0", plant=plant, air="regulator").unwrapped
    assert off.plant.digest() == SingleMuscle.mas10().digest()
    with pytest.raises(ValueError, match="dynamics = 'muscles'"):
        gym.make("PAM/AntagonisticJoint-v0", plant=AntagonisticJoint.reduced(), air="flow")
