"""Adaptive inverse of the knee: estimates of gain and loop width, inverse, probe, rows."""

import dataclasses

import numpy as np
import pytest

from baselines.core.entry import Spec
from baselines.knee import adaptive_inverse
from baselines.knee.adaptive_inverse import (
    BEFORE,
    PROBE,
    AdaptiveState,
    make_knee_adaptive_inverse,
)
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from tests.baselines.conftest import built, last_state, make_env, rms, rollout

TENSION = "PAM/KneeTension-v0"
GAIN, WIDTH = 1.08, 0.7
TRUE = {"muscle.gain": GAIN, "hysteresis.width": WIDTH}


def other_muscle(kind: str = "maxwell_slip") -> tuple[object, KneeOrthosis]:
    """Return the environment of a brace with another muscle, and the nominal brace."""
    nominal = make_env(TENSION, hysteresis=kind).unwrapped.plant
    return make_env(TENSION, plant=nominal.replace(TRUE), reference="sine"), nominal


def settled_error(name: str) -> float:
    """Return the RMS error [N] after 3 s with another muscle than the nominal one."""
    env, nominal = other_muscle()
    record = rollout(env, built(name, env, nominal))
    return rms((record["output"] - record["reference"])[300:])


def test_loop_width_and_gain_are_estimated():
    env, nominal = other_muscle()
    controller = built("knee_adaptive_inverse", env, nominal)
    state, _ = last_state(env, controller)
    a, b = state.estimate[0]
    assert a == pytest.approx(GAIN, rel=0.03)
    assert b / a == pytest.approx(WIDTH, abs=0.06)


def test_estimated_muscle_is_tracked_better_than_by_the_gain_alone():
    assert settled_error("knee_adaptive_inverse") < 0.3 * settled_error(
        "knee_anticipating_adaptive"
    )


@pytest.mark.parametrize("width", [0.5, 0.8, 1.25])
def test_inverse_gives_the_stiffness_of_the_estimates(width):
    env = make_env(TENSION)
    base = env.unwrapped
    controller = make_knee_adaptive_inverse(Spec(base.plant, base.signals, base.action_signals))
    nominal = controller.forward.observer.nominal
    later = nominal.inflated(np.array([3e5]))
    now = AdaptiveState(None, np.array([[1.1, 1.1 * width]]), np.zeros((1, 3)), np.array([50.0]))
    stiffness = np.linspace(2500.0, 5000.0, 12)[None]
    pressure = controller._inverse(now, stiffness, later)
    held = tuple(np.repeat(part, 12, axis=0) for part in later)
    output = nominal.stiffness_after(pressure[0], held)
    line = controller._slope * pressure[0]
    found = 1.1 * (line + width * (output - line)) + 50.0
    assert found == pytest.approx(stiffness[0], rel=0.01)


def test_forgetting_ends_at_the_variances_before_the_first_sample():
    env, nominal = other_muscle()
    controller = built("knee_adaptive_inverse", env, nominal)
    observation, _ = env.reset(seed=1)
    state = controller.predict(observation, None, True)[1]
    hasty = dataclasses.replace(controller, forgetting=1e-3)
    for _ in range(5):
        state = hasty._estimated(observation, state)
    assert (state.covariance[0, :2] <= BEFORE[:2] * (1.0 + 1e-12)).all()
    assert np.isfinite(state.estimate).all()


def test_probe_moves_the_setpoint_in_a_first_swing_alone(monkeypatch):
    env = make_env("PAM/KneeWalk-v0")
    controller = built("knee_adaptive_inverse", env)
    probed = []
    for seed in range(6):
        observation, _ = env.reset(seed=seed)
        state = None
        for step in range(40):
            stance = bool(controller.forward.observer.read(observation).stance[0])
            with monkeypatch.context() as quiet:
                quiet.setattr(adaptive_inverse, "PRESSURE", 0.0)
                action, after = controller.predict(observation, state, state is None)
            if abs(controller.predict(observation, state, state is None)[0] - action).max() > 1e-3:
                probed.append((step, stance))
            state = after  # estimates that no probe has changed
            observation, *_ = env.step(action)
    assert probed
    assert all(PROBE[0] <= step < PROBE[1] and not stance for step, stance in probed)


def test_row_of_a_batch_is_the_single_episode():
    env = make_env("PAM/KneeWalk-v0")
    controller = built("knee_adaptive_inverse", env)
    seen = []
    for seed in (1, 2):
        observation, _ = env.reset(seed=seed)
        seen.append([observation])
        for _ in range(60):
            observation, *_ = env.step(env.action_space.high)
            seen[-1].append(observation)
    alone, together, state = None, None, [None, None]
    for pair in zip(*seen, strict=True):
        together, both = controller.predict(np.array(pair), state[0], state[0] is None)
        alone, one = controller.predict(pair[1], state[1], state[1] is None)
        state = [both, one]
        assert np.array_equal(together[1], alone)
