"""Episodes of the real-time environment through Modbus TCP, on the registers of a simulated rig."""

import math

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("pymodbus")
from baselines.core.catalogue import make_controller
from pam_envs.plants import SingleMuscle
from pam_envs.rig.driver import SystemClock
from pam_envs.rig.env import RealTimeEnv
from pam_envs.rig.log import RecordingLog
from pam_envs.rig.modbus import ModbusDriver
from pam_envs.rig.simulated import SimulatedClock, SimulatedDriver
from sweeps.limits import scaled
from tests.rig.register_bank import INPUTS, OUTPUTS, WATCHDOG, RigBank, device, serving

ID = "PAM/MusclePositioning-v0"
SHARED = {"load": 2.55, "start": "rest", "reference": "staircase"}
LIMITS = {"contraction": (-0.005, 0.025), "pressure": (-2e4, 6.2e5)}
REST = 0.1  # s, ten control periods and one more
TRUE = SingleMuscle.mas10("maxwell_slip").replace({"regulator.time_constant": 0.08})
PRESSURE_STEP = 1e6 / 27648  # Pa, one count of the converter


class WallClock(SystemClock):
    """Clock of the computer for a simulated rig without delays of its own."""

    def advance(self, seconds):
        assert seconds == 0.0


def simulated(clock, watchdog):
    """Return the driver of a plant that is not the nominal one."""
    hidden = gym.make(ID, plant=TRUE, episode_seconds=600.0, **SHARED)
    return SimulatedDriver(hidden, clock, watchdog=watchdog)


def env_of(driver, clock, seconds, **more):
    twin = gym.make(ID, episode_seconds=seconds, **SHARED)
    return RealTimeEnv(twin, driver, LIMITS, clock=clock, rest_seconds=REST, **more)


def modbus(port, clock):
    return ModbusDriver(
        *("127.0.0.1", INPUTS, OUTPUTS, WATCHDOG),
        port=port,
        timeout=scaled(10.0),
        clock=clock,
    )


def episode(env):
    """Run a controller for an episode; return actions, readings and the last step."""
    controller = make_controller("inverse_pid", env.plant, env.signals, env.action_signals)
    observation, info = env.reset(seed=2)
    state, start, over, actions, readings = None, True, False, [], []
    while not over:
        action, state = controller.predict(observation, state, start)
        observation, _, terminated, truncated, info = env.step(action)
        start, over = False, terminated or truncated
        actions.append(float(env.action_signals.decode(action, "pressure_set_point")))
        readings.append([info["sensor/pressure"], info["sensor/contraction"]])
        seen = env.signals.decode(observation, "contraction")
        assert seen == pytest.approx(info["sensor/contraction"], abs=1e-8)
    return np.array(actions), np.array(readings), (terminated, truncated, info)


def test_episode_through_modbus_is_that_of_the_rig_but_for_the_converter():
    clock = SimulatedClock()
    direct = env_of(simulated(clock, 0.1), clock, 4.0)
    actions, readings, _ = episode(direct)
    clock = SimulatedClock()
    bank = RigBank(simulated(clock, 0.1))
    with serving(device([0, 0], bank.act)) as port:
        env = env_of(modbus(port, clock), clock, 4.0)
        found, seen, (terminated, truncated, info) = episode(env)
        assert (terminated, truncated, info["overruns"]) == (False, True, 0.0)
        assert info["time"] == pytest.approx(4.0)
        assert bank.rig.vented
        env.close()
    assert len(found) == len(actions) == 400
    np.testing.assert_allclose(found, actions, atol=2e4)  # Pa, feedback of rounded readings
    np.testing.assert_allclose(seen[:, 0], readings[:, 0], atol=1e4)  # Pa
    np.testing.assert_allclose(seen[:, 1], readings[:, 1], atol=2e-4)  # m
    written = np.array([number for number in bank.setpoints if number])
    np.testing.assert_allclose(written * PRESSURE_STEP, found[found > 0], atol=PRESSURE_STEP)
    assert bank.setpoints[0] == bank.setpoints[-1] == 0
    assert bank.beats == list(range(1, 11 + 400 + 1))


def test_episode_on_the_clock_of_the_computer_ends_vented_and_is_recorded(tmp_path):
    clock = WallClock()
    bank = RigBank(simulated(clock, math.inf))
    path = tmp_path / "rig.csv"
    with serving(device([0, 0], bank.act)) as port:
        env = env_of(
            modbus(port, clock),
            clock,
            0.5,
            log=RecordingLog(path, load=25.0),
            longest_delay=math.inf,
            oldest_sample=math.inf,
        )
        actions, readings, (terminated, truncated, info) = episode(env)
        assert (terminated, truncated) == (False, True)
        assert info["time"] == pytest.approx(0.5)
        assert bank.rig.vented
        env.close()
    assert 1 <= len(actions) <= 50  # a late period is skipped
    assert bank.setpoints[-1] == 0
    assert bank.beats == list(range(1, 11 + len(actions) + 1))
    assert np.isfinite(readings).all()
    assert len(path.read_text().splitlines()) == 1 + len(actions) + 1


def test_rig_vents_by_its_watchdog_if_the_loop_stalls():
    clock = SimulatedClock()
    bank = RigBank(simulated(clock, 0.1))
    with serving(device([0, 0], bank.act)) as port:
        env = env_of(modbus(port, clock), clock, 2.0)
        env.reset(seed=0)
        for _ in range(60):
            *_, info = env.step(np.zeros(1, np.float32))
        assert info["sensor/pressure"] > 2e5
        assert not bank.rig.vented
        clock.advance(2.0)
        assert abs(env.driver.read().values["pressure"]) < 2e4
        assert bank.rig.vented
        env.close()


def test_lost_device_ends_the_episode_with_an_error_and_the_log_is_closed(tmp_path):
    clock = SimulatedClock()
    bank = RigBank(simulated(clock, 0.1))
    log = RecordingLog(tmp_path / "rig.csv", load=25.0)
    with serving(device([0, 0], bank.act)) as port:
        env = env_of(modbus(port, clock), clock, 2.0, log=log)
        env.reset(seed=0)
        env.step(np.zeros(1, np.float32))
    with pytest.raises(OSError, match="is not vented"):
        env.step(np.zeros(1, np.float32))
    with pytest.raises(gym.error.ResetNeeded):
        env.step(np.zeros(1, np.float32))
    with pytest.raises(OSError, match="is not vented"):
        env.close()
    assert log._file is None
    env.close()
