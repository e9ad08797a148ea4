"""Anticipating inverse of the knee: anticipation, phase, adaptation, learning from strides."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from baselines.core.entry import Spec
from baselines.knee.learning import GAIN, make_knee_repetitive
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from tests.baselines.conftest import built, make_env, rms, rollout


def tracked(record: dict[str, np.ndarray]) -> np.ndarray:
    """Return where the tension is tracked, after 1 s."""
    mask = (record["state/stance"] > 0.5) & (record["sensor/stance"] > 0.5)
    mask[:100] = False
    return mask


@cache
def walk_error(name: str, **changes: float) -> float:
    """Return the RMS error of a walk with varied strides; ``changes`` of the true plant."""
    nominal = KneeOrthosis.on_leg().replace({"stride.variability": 0.03})
    true = nominal.replace({key.replace("__", "."): value for key, value in changes.items()})
    env = make_env("PAM/KneeWalk-v0", plant=true, episode_seconds=8.0)
    record = rollout(env, built(name, env, nominal))
    return rms((record["output"] - record["reference"])[tracked(record)])


def test_anticipation_reduces_the_error_of_the_inverse_to_a_third():
    assert walk_error("knee_anticipating") < walk_error("knee_inverse") / 3.0


def test_regulator_and_gain_are_adapted_to_another_plant():
    changes = {"regulator__dead_time": 0.09, "muscle__gain": 1.1, "leg__body_mass": 80.0}
    plain, adaptive = (
        walk_error(name, **changes) for name in ("knee_anticipating", "knee_anticipating_adaptive")
    )
    assert adaptive < 0.6 * plain


def test_phase_of_the_wearer_is_found():
    env = make_env("PAM/KneeWalk-v0", episode_seconds=6.0, start="heel_contact")
    controller = built("knee_anticipating", env)
    observation, info = env.reset(seed=3)
    state, over, found, phase = None, False, [], []
    while not over:
        phase.append(info["state/phase"])
        action, state = controller.predict(observation, state, state is None)
        found.append(state.plan.shift[0])
        observation, _, _, over, info = env.step(action)
    shift = 500.0 * np.unwrap(phase, period=1.0) - np.arange(len(phase))
    late = slice(440, 490)  # end of swing, where the path of the knee shows the phase
    apart = np.mod(shift + 250.0, 500.0) - 250.0
    assert np.abs(apart[late]).mean() > 3.0
    off = np.mod(np.array(found) - shift + 250.0, 500.0) - 250.0
    assert np.abs(off[late]).max() < 1.5


def test_start_is_bumpless():
    env = make_env("PAM/KneeTension-v0", reference=np.full(50, 158.0), episode_seconds=0.5)
    for name in ("knee_anticipating", "knee_anticipating_adaptive"):
        record = rollout(env, built(name, env))
        assert np.abs(np.diff(record["command"])).max() < 0.5e5


def strides(learning: float) -> np.ndarray:
    """Return the RMS error in mid-stance of each stride on another muscle than the nominal one."""
    nominal = KneeOrthosis.on_leg().without_noise()
    true = nominal.replace({"muscle.gain": 1.1, "hysteresis.width": 0.8})
    env: Any = make_env("PAM/KneeWalk-v0", plant=true, strides="identical", start="heel_contact",
                        episode_seconds=30.0)  # fmt: skip
    spec = Spec(nominal, env.signals, env.action_signals, {"learning": learning})
    record = rollout(env, make_knee_repetitive(spec, adaptive=False))
    error = (record["output"] - record["reference"]).reshape(-1, 500)
    return np.sqrt(np.mean(error[:, 60:230] ** 2, axis=1))


def test_error_contracts_from_stride_to_stride_as_predicted():
    errors = strides(1.0)
    assert errors[-1] < errors[0] / 3.0
    rates = errors[2:] / errors[1:-1]
    # |1 - gain P|; a rise of 1.1 in gain, and of up to a quarter where the loop is narrower
    assert 1.0 - GAIN * 1.35 < np.exp(np.mean(np.log(rates))) < 1.0 - GAIN * 0.95


@pytest.mark.parametrize("hysteresis", ["maxwell_slip", "preisach"])
def test_stiffness_is_tracked_within_rounding_of_the_sensors(hysteresis):
    plant = KneeOrthosis.rig(hysteresis=hysteresis).without_noise()
    env = make_env("PAM/KneeStiffness-v0", plant=plant, reference="sine", frequency=0.2,
                   episode_seconds=6.0)  # fmt: skip
    record = rollout(env, built("knee_anticipating", env))
    error = (record["output"] - record["reference"])[200:]
    assert rms(error) < 2e-3 * np.ptp(record["reference"])


def test_tension_is_held_until_toe_off():
    plant = KneeOrthosis.on_leg("stairs_down").without_noise()
    env = make_env("PAM/KneeStairsDown-v0", plant=plant, strides="identical", episode_seconds=11.0)
    record = rollout(env, built("knee_anticipating", env))
    stance, error = tracked(record), np.abs(record["output"] - record["reference"])
    toe_off = np.flatnonzero(stance[:-1] & ~stance[1:])
    before = np.array([error[k - 20 : k + 1] for k in toe_off])
    assert len(before) > 1
    assert before.max() < 8.0  # of 280 N; the setpoint falls by 5 N a control period
