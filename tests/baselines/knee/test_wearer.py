"""The wearer's deviation under the assistance, and the nominal stride beyond a preview."""

from dataclasses import replace

import numpy as np
import pytest

from baselines.core.entry import Spec
from baselines.knee.anticipation import make_knee_anticipation
from baselines.knee.stride import ANGLE_MISFIT, TENSION_MISFIT, NominalStride
from baselines.knee.wearer import WearerModel
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from tests.baselines.conftest import built, last_state, make_env, rms, rollout
from tests.baselines.knee.test_anticipation import tracked

GAITS = {"KneeWalk": "walk", "KneeStairsUp": "stairs_up", "KneeStairsDown": "stairs_down"}


def quiet_walk(**changes):
    """Return a walk of identical strides without noise; ``changes`` of the true plant."""
    nominal = KneeOrthosis.on_leg().without_noise()
    true = nominal.replace({key.replace("__", "."): value for key, value in changes.items()})
    env = make_env("PAM/KneeWalk-v0", plant=true, strides="identical", episode_seconds=8.0)
    return env, nominal


def test_deviation_of_the_nominal_leg_is_that_of_the_plant():
    env, nominal = quiet_walk()
    controller = built("knee_anticipating", env, nominal)
    observation, info = env.reset(seed=3)
    state, over, pairs = None, False, []
    while not over:
        action, state = controller.predict(observation, state, state is None)
        pairs.append((state.wearer[0, 0], info["state/deviation"], info["state/stance"]))
        observation, _, _, over, info = env.step(action)
    found, true, stance = np.array(pairs)[100:].T
    assert np.ptp(true[stance > 0.5]) > 0.04
    assert rms((found - true)[stance > 0.5]) < 0.02 * np.ptp(true[stance > 0.5])


def test_prediction_is_not_late():
    """A deviation that is held constant for the dead time is late by 0.7 control periods."""
    env, nominal = quiet_walk()
    record = rollout(env, built("knee_anticipating", env, nominal))
    error, rate = record["output"] - record["reference"], np.gradient(record["reference"])
    inside = tracked(record)
    for _ in range(30):  # without the fall after heel contact, which the rate limit determines
        inside &= np.roll(inside, 1)
    assert inside.sum() > 200
    assert abs(error[inside] @ rate[inside] / (rate[inside] @ rate[inside])) < 0.1


@pytest.mark.parametrize("stiffness", [150.0, 350.0])
def test_compliance_of_another_wearer_is_estimated(stiffness):
    env, nominal = quiet_walk(leg__stance_stiffness=stiffness)
    controller = built("knee_anticipating", env, nominal)
    state, _ = last_state(env, controller, seed=3)
    ratio = (state.yielding[0, :, 1] / state.yielding[0, :, 0])[1]
    expected = 250.0 / stiffness
    assert abs(ratio - expected) < 0.5 * abs(1.0 - expected)


@pytest.mark.parametrize("load", [0.0, 1.0])
def test_deviation_settles_where_the_torque_is_borne(load):
    plant = KneeOrthosis.on_leg()
    model = WearerModel(plant)
    course = model.along(np.zeros((1, 2)), np.full((1, 400), 5.0), np.full((1, 400), load))
    leg = plant.leg
    upright = leg.mass * 9.80665 * leg.centre
    hold = leg.stiffness + leg.hold_stiffness + upright + leg.stance_stiffness * load
    assert course[0, -1, 0] == pytest.approx(-5.0 / hold, rel=1e-3)
    assert course[0, -1, 1] == pytest.approx(0.0, abs=1e-4)


def test_brace_is_carried_along_a_path():
    plant = KneeOrthosis.on_leg()
    time = np.arange(6) * plant.control_period
    path = (1.8 + 0.5 * time + 0.5 * 3.0 * time**2)[None]
    torque = WearerModel(plant).passive(path)[0]
    rate = 0.5 + 3.0 * time[1:-1]
    assert torque == pytest.approx(plant.lever.damping * rate + plant.lever.inertia * 3.0)


@pytest.mark.parametrize(("delay", "tolerance"), [((4.0, 6.0), 1e-12), ((4.5, 5.3), 4e-4)])
def test_response_is_the_derivative_of_the_course(delay, tolerance):
    """Of a dead time that is no whole number, what a torque does before its node is left out."""
    leg, draws = WearerModel(KneeOrthosis.on_leg()), np.random.default_rng(1)
    delay = np.array(delay)
    ends = delay[:, None] + np.cumsum([1, 1, 1, 2, 2, 4, 4])
    count = int(np.ceil(ends.max())) + 1
    load, scale = draws.uniform(0.0, 1.0, (2, count)), draws.uniform(0.5, 2.0, (2, count + 1))
    torque, halves = draws.normal(0.0, 2.0, ends.shape), np.arange(count) + 0.5
    given = np.stack([np.interp(halves, ends[i], torque[i]) for i in range(2)])
    given = np.where(halves < delay[:, None], 0.0, given)
    course = leg.along(np.zeros((2, 2)), given, load)[..., 0] * scale
    times = np.arange(count + 1)
    off = [np.interp(ends[i], times, course[i]) for i in range(2)]
    made = leg.response(load, scale, ends, delay)
    np.testing.assert_allclose((made @ torque[..., None])[..., 0], off, atol=tolerance)
    assert not np.triu(made, 1).any()


def test_load_and_stance_are_those_of_the_leg():
    stride = NominalStride(KneeOrthosis.on_leg())
    assert stride.loads.min() >= 0.0
    assert 0.9 < stride.loads.max() < 1.3
    assert not stride.stance[stride.loads == 0.0].any()
    points = np.array([0.0, 17.0, 17.4])
    np.testing.assert_array_equal(stride.load(points), stride.loads[[0, 17, 17]])
    np.testing.assert_array_equal(stride.in_stance(points), stride.stance[[0, 17, 17]])


@pytest.mark.parametrize("name", GAITS)
def test_nominal_stride_is_the_planned_one(name):
    env = make_env(f"PAM/{name}-v0", episode_seconds=8.0)
    stride = NominalStride(KneeOrthosis.on_leg(GAITS[name]))
    controller = make_knee_anticipation(Spec(stride.plant, env.signals, env.action_signals))
    ahead = controller.phase.memory.ahead
    observation, _ = env.reset(seed=5)
    off, places = [], []
    for step in range(300):
        seen = controller._samples(observation)[:, :, 1:]
        place = stride.phase(seen, ahead[1:], np.ones(1, bool), np.zeros(1))
        off.append(seen[0, :, -1] - stride.read(place[:, None] + ahead[-1])[:, 0, 0])
        places.append(place[0] - step)
        observation, *_ = env.step(env.action_space.low)
    assert np.ptp(np.unwrap(places, period=500.0)) < 0.1
    tension, angle = np.abs(off).T
    assert np.median(tension) < 1.0
    assert angle.max() < 0.01


def test_point_of_the_stride_is_the_one_of_least_misfit():
    stride = NominalStride(KneeOrthosis.on_leg("walk"))
    ahead, rng = np.arange(5, 60, 5), np.random.default_rng(0)
    true = np.array([40.0, 333.0, 7.0])
    noise = rng.normal(0.0, 1.0, (3, 2, len(ahead))) * np.array([5.0, 0.005])[:, None]
    seen = stride.read(true[:, None] + ahead).swapaxes(0, 1) + noise
    every = np.arange(stride.samples.shape[1])[:, None] + ahead
    scale = np.array([TENSION_MISFIT, ANGLE_MISFIT])[:, None, None]
    misfit = (((seen[:, :, None] - stride.read(every)) / scale) ** 2).sum(axis=(1, 3))
    sought = np.array([True, True, False])
    found = stride.phase(seen, ahead, sought, np.array([0.0, 0.0, 91.5]))
    assert np.abs(found[:2] - np.argmin(misfit[:2], axis=1)).max() <= 0.5
    assert np.abs(found[:2] - true[:2]).max() <= 3.0
    assert found[2] == 91.5


def test_point_of_the_stride_is_found_between_samples():
    stride = NominalStride(KneeOrthosis.on_leg("walk"))
    ahead, true = np.arange(5, 60, 5), 40.0 + np.linspace(0.0, 1.0, 11)
    low = stride.read(np.floor(true)[:, None] + ahead)
    high = stride.read(np.floor(true)[:, None] + ahead + 1)
    seen = (low + (true % 1.0)[:, None] * (high - low)).swapaxes(0, 1)
    found = stride.phase(seen, ahead, np.ones(11, bool), np.zeros(11))
    np.testing.assert_allclose(found, true, atol=0.02)


@pytest.mark.parametrize("name", GAITS)
def test_torque_of_the_nominal_stride_is_the_reference_also_in_swing(name):
    plant = KneeOrthosis.on_leg(GAITS[name]).without_noise()
    env = make_env(f"PAM/{name}-v0", plant=plant, strides="identical", episode_seconds=6.0,
                   start="heel_contact", normalize=False)  # fmt: skip
    column, found = env.unwrapped.signals["torque_reference"].index, []
    observation, _ = env.reset(seed=0)
    for _ in range(590):
        found.append(observation[column])
        observation, *_ = env.step(np.zeros(1))
    expected = NominalStride(plant).torque(np.arange(590.0))
    assert np.ptp(expected) > 5.0
    assert np.abs(np.array(found) - expected)[20:].max() < 0.05 * np.ptp(expected)


def test_unseen_stride_continues_the_preview():
    env = make_env("PAM/KneeWalk-v0", mismatch=12.0, ratio=0.3)
    controller = built("knee_anticipating", env)
    ends = np.arange(1.0, 120.0)[None]
    for seed in range(3):
        observation, _ = env.reset(seed=seed)
        state = controller.initial_state(observation)
        for _ in range(40):
            state = controller.observed(observation, state)
            samples, _ = controller._ahead(state, ends)
            held, known = controller.phase.read(state.plan, ends)
            assert np.array_equal(samples[:, :, known[0]], held[:, :, known[0]])
            unseen = np.flatnonzero(~known[0])
            first = unseen[0]
            stance = controller._in_stance(samples[:, 0], samples[:, 1], state)[0]
            if stance[first - 1] == stance[first]:
                assert abs(samples[0, 0, first] - held[0, 0, first - 1]) < 15.0
            assert abs(samples[0, 1, first] - held[0, 1, first - 1]) < 0.05
            assert np.ptp(samples[0, 1, unseen]) > 0.05  # goes on with the stride
            observation, *_ = env.step(env.action_space.low)


def test_stride_of_another_pace_has_its_own_length():
    plant = KneeOrthosis.on_leg()
    quick = NominalStride(replace(plant, stride=replace(plant.stride, time=1.224)))
    assert quick.samples.shape == (2, 123)
    assert quick.read(np.array([0.0, 122.4])) == pytest.approx(
        np.repeat(quick.samples[:, :1], 2, axis=1)
    )
