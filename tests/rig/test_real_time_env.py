"""Episodes on a simulated rig: timing, stops, watchdog and log, on a simulated clock."""

import math

import gymnasium as gym
import numpy as np
import pytest

from baselines.core.catalogue import make_controller
from pam_envs.constants import GRAVITY
from pam_envs.data.recording.recording import read_input
from pam_envs.data.rig_file import Rig
from pam_envs.plants import SingleMuscle
from pam_envs.rig.driver import Sample
from pam_envs.rig.env import RealTimeEnv
from pam_envs.rig.log import RecordingLog
from pam_envs.rig.simulated import SimulatedClock, SimulatedDriver

ID = "PAM/MusclePositioning-v0"
SHARED = {"load": 2.55, "start": "rest", "reference": "staircase"}
LIMITS = {"contraction": (-0.005, 0.025), "pressure": (-2e4, 6.2e5)}
REST = 0.5  # s, 50 control periods and one more
PERIOD = 0.01


class Wrapped:
    """A driver around another one."""

    def __init__(self, driver):
        self.inner = driver

    def __getattr__(self, name):
        return getattr(self.inner, name)


def rig(seconds=1.0, true=None, limits=LIMITS, log=None, wrap=lambda driver: driver, **timing):
    """Return a rig of one plant, or of another plant than its twin, with imperfect timing."""
    clock = SimulatedClock()
    hidden = gym.make(ID, plant=true, episode_seconds=600.0, **SHARED)
    twin = gym.make(ID, episode_seconds=seconds, **SHARED)
    driver = wrap(SimulatedDriver(hidden, clock, **timing))
    env = RealTimeEnv(twin, driver, limits, clock=clock, rest_seconds=REST, log=log)
    return env, driver


def run(env, steps=10_000, level=0.0):
    """Apply a constant action until the episode ends; return the last step."""
    env.reset(seed=0)
    for _ in range(steps):
        last = env.step(np.array([level], np.float32))
        if last[2] or last[3]:
            break
    return last


def test_controller_built_from_the_signals_tracks_on_another_plant():
    true = SingleMuscle.mas10("maxwell_slip").replace({"regulator.time_constant": 0.08})
    env, driver = rig(4.0, true)
    controller = make_controller("inverse_pid", env.plant, env.signals, env.action_signals)
    observation, info = env.reset(seed=2)
    assert env.observation_space.contains(observation)
    state, start, over, errors, gaps = None, True, False, [], []
    while not over:
        action, state = controller.predict(observation, state, start)
        observation, reward, terminated, truncated, info = env.step(action)
        assert env.observation_space.contains(observation)
        start, over = False, terminated or truncated
        errors.append(info["output"] - info["reference"])
        gaps.append(info["output"] - info["twin/output"])
        assert reward == pytest.approx(-abs(errors[-1]) / 0.03)
        seen = env.signals.decode(observation, "contraction")
        assert seen == pytest.approx(info["sensor/contraction"], abs=1e-8)
    assert not terminated
    assert info["time"] == pytest.approx(4.0)
    assert np.sqrt(np.mean(np.square(errors[200:]))) < 1e-3  # m
    assert 1e-5 < np.sqrt(np.mean(np.square(gaps))) < 1e-3  # m: readings are those of the rig
    assert info["overruns"] == 0.0
    assert driver.vented


def test_jitter_within_a_tenth_of_the_period_is_no_overrun():
    env, _ = rig(jitter=1e-4)
    *_, terminated, truncated, info = run(env)
    assert (terminated, truncated, info["overruns"]) == (False, True, 0.0)


def test_stall_is_counted_and_the_episode_keeps_the_time_of_the_rig():
    env, driver = rig(stalls={51 + 20: 0.014})  # the reading at the end of the 20th period
    env.oldest_sample = 0.02
    env.reset(seed=0)
    times, counts, late = [], [], []
    for _ in range(30):
        *_, info = env.step(np.zeros(1, np.float32))
        times.append(round(info["time"] / PERIOD))
        counts.append(info["overruns"])
        late.append(info["late"])
    assert not driver.vented
    assert times[18:22] == [19, 20, 21, 22]
    assert late[20] == 0.0
    assert late[21] == pytest.approx(0.004)
    assert counts[20:23] == [0.0, 1.0, 1.0]


def test_periods_that_pass_during_a_slow_action_are_simulated_by_the_twin():
    env, _ = rig()
    env.reset(seed=0)
    env.step(np.zeros(1, np.float32))
    env.clock.advance(0.025)  # computation of the next action
    *_, terminated, _, info = env.step(np.zeros(1, np.float32))
    assert not terminated
    assert info["late"] == pytest.approx(0.015)
    assert info["overruns"] == 1.0
    assert info["time"] == pytest.approx(0.03)
    *_, info = env.step(np.zeros(1, np.float32))
    assert info["late"] == 0.0
    assert info["time"] == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("timing", "reason"),
    [
        ({"drops": {51 + 7}}, "sample lost: the driver has none"),
        ({"stalls": {51 + 7: 0.012}}, "sample lost: the latest one is 12.0 ms old"),
        ({"frozen": 51 + 7}, "sample lost: the latest one is 10.0 ms old"),
    ],
)
def test_lost_sample_stops_with_vented_muscles(timing, reason):
    env, driver = rig(**timing)
    *_, terminated, truncated, info = run(env, level=0.5)
    assert (terminated, truncated) == (True, False)
    assert info["stop"] == reason
    assert driver.vented
    assert driver.readings == 51 + 8
    with pytest.raises(gym.error.ResetNeeded, match="no episode is running on the rig"):
        env.step(np.zeros(1, np.float32))


def test_missed_deadline_stops():
    env, driver = rig()
    env.reset(seed=0)
    env.step(np.zeros(1, np.float32))
    env.clock.advance(0.05)
    *_, terminated, _, info = env.step(np.zeros(1, np.float32))
    assert terminated
    assert "deadline missed by 40.0 ms, more than 30.0 ms" in info["stop"]
    assert driver.vented


def test_reading_outside_its_limits_stops():
    env, driver = rig(3.0, limits={**LIMITS, "pressure": (-2e4, 4e5)})
    *_, terminated, _, info = run(env, level=1.0)
    assert terminated
    assert info["stop"].startswith("limit: pressure = ")
    assert info["stop"].endswith("Pa is outside [-20000, 400000] Pa")
    assert info["sensor/pressure"] > 4e5
    assert driver.vented
    env.reset(seed=1)
    assert env.step(np.full(1, -1.0, np.float32))[4]["overruns"] == 0.0


def test_reading_that_is_no_number_counts_as_lost():
    class Broken(Wrapped):
        def read(self):
            sample = self.inner.read()
            broken = self.inner.readings > 60
            return Sample(
                sample.time, {**sample.values, "pressure": math.nan} if broken else sample.values
            )

    env, driver = rig(wrap=Broken)
    *_, terminated, _, info = run(env)
    assert terminated
    assert info["stop"] == "sample lost: pressure is nan"
    assert driver.vented


def test_watchdog_vents_while_the_computer_does_nothing():
    env, driver = rig(watchdog=0.1)
    env.reset(seed=0)
    for _ in range(50):
        *_, info = env.step(np.zeros(1, np.float32))
    assert info["sensor/pressure"] > 2e5
    assert not driver.vented
    env.clock.advance(2.0)
    driver.read()
    assert driver.vented
    assert driver.env.signals is not None
    assert driver.read().values["pressure"] > -2e4
    assert driver.read().values["pressure"] < 2e4


def test_error_of_a_controller_or_driver_vents():
    env, driver = rig()
    env.reset(seed=0)
    env.step(np.zeros(1, np.float32))
    with pytest.raises(ValueError, match="finite"):
        env.step(np.array([np.nan], np.float32))
    assert driver.vented
    env.reset(seed=0)
    env.step(np.zeros(1, np.float32))
    driver.write = lambda setpoints: (_ for _ in ()).throw(OSError("cable"))
    with pytest.raises(OSError, match="cable"):
        env.step(np.zeros(1, np.float32))
    assert driver.vented


def test_lost_sample_at_rest_prevents_the_start():
    env, driver = rig(drops={3})
    with pytest.raises(RuntimeError, match="the rig cannot start: sample lost"):
        env.reset(seed=0)
    assert driver.vented


def test_zeroed_sensor_reads_zero_after_the_rest():
    class Shifted(Wrapped):
        def read(self):
            sample = self.inner.read()
            moved = sample.values["contraction"] + 0.1
            return Sample(sample.time, {**sample.values, "contraction": moved})

    env, _ = rig(wrap=Shifted)
    with pytest.raises(RuntimeError, match="cannot start: limit: contraction"):
        env.reset(seed=0)
    env.zeroed = ("contraction",)
    _, info = env.reset(seed=0)
    assert abs(info["sensor/contraction"]) < 3e-4  # m, noise of two readings


def test_log_is_a_recording_that_the_diagnosis_reads(tmp_path):
    path = tmp_path / "rig.csv"
    env, _ = rig(1.5, log=RecordingLog(path, load=2.55 * GRAVITY), jitter=5e-5)
    levels = np.repeat([-1.0, -0.2, 0.4], 50)
    for episode in range(2):
        env.reset(seed=episode)
        outputs, commands = [], []
        for level in levels:
            info = env.step(np.array([level], np.float32))[4]
            outputs.append(info["sensor/contraction"])
            commands.append(3e5 * (1.0 + level))
    env.close()
    found = read_input(path, Rig())
    assert found.segments == ("episode_0", "episode_1")
    last = found.segment == 1
    assert last.sum() == 151
    np.testing.assert_allclose(found.command[last][:-1], commands, rtol=1e-5)
    np.testing.assert_allclose(found.contraction[last][1:], outputs, atol=1e-5)
    np.testing.assert_allclose(found.load, 2.55 * GRAVITY, rtol=1e-5)
    assert found.restart.sum() == 2
    with pytest.raises(FileExistsError):
        run(rig(log=RecordingLog(path, load=0.0))[0])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"limits": {"contraction": (0.0, 1.0)}}, "limits of 'pressure': give its lowest"),
        ({"limits": {**LIMITS, "pressure": (1.0, 0.0)}}, "limits of 'pressure'"),
        ({"sensors": ("length",)}, "sensor 'length' is no signal; there are: contraction"),
        ({"sensors": ("pressure",)}, "output = 'contraction' is no sensor: pressure"),
    ],
)
def test_wrong_sensors_and_limits_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        rig(**changes)


def test_rest_below_the_control_period_is_refused():
    with pytest.raises(ValueError, match="rest_seconds = 0 s is below the control period"):
        RealTimeEnv(gym.make(ID), rig()[1], LIMITS, rest_seconds=0.0)
