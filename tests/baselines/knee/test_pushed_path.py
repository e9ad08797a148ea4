"""Path of the pressure that pushes the knee: against a general solver, and in the walk."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from baselines.knee import anticipation, pushed_path
from baselines.knee.pushed_path import Push
from baselines.predictive.rate_limited import best_path
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from tests.baselines.conftest import built, make_env, rms, rollout
from tests.baselines.knee.test_anticipation import tracked

ROWS = 8
BLOCKS = np.array(anticipation.BLOCKS)
NODES = len(BLOCKS)


def problem(push_scale: float = 1.0):
    """Return a problem with the nodes and weights of the controller, swing before stance.

    ``push_scale`` scales the deviations.
    """
    draws = np.random.default_rng(2)
    shape = (ROWS, NODES)
    start = draws.uniform(1e5, 2e5, ROWS)
    path = 2e5 + np.cumsum(draws.normal(0.0, 8e3 * BLOCKS**0.5, shape), axis=1)
    stance = np.arange(NODES) >= draws.integers(0, NODES - 4, ROWS)[:, None]
    weight = BLOCKS * np.where(stance, 1.0, anticipation.SWING)
    reach = np.tile(6.8e3 * BLOCKS, (ROWS, 1))
    push = Push(
        excess=draws.normal(0.0, 2.0, shape),
        per_pressure=draws.uniform(3e-5, 6e-5, shape),
        per_angle=draws.uniform(20.0, 60.0, shape),
        pressure_per_angle=draws.uniform(-2e6, -5e5, shape),
    )
    response = -push_scale * np.tril(draws.uniform(0.0, 8e-4, (ROWS, NODES, NODES)))
    return start, path, weight, reach, push, response, 1e6


def test_path_is_the_solution_of_the_bounded_least_squares_problem(monkeypatch):
    monkeypatch.setattr(pushed_path, "ITERATIONS", 3000)
    given = problem()
    start, path, weight, reach, push, response, _ = given
    found, deviation = pushed_path.pushed_path(*given)
    for row in range(ROWS):
        inner = np.eye(NODES) - response[row] * push.per_angle[row]
        closed = np.linalg.solve(inner, response[row])
        slope = push.pressure_per_angle[row]
        matrix = np.eye(NODES) - slope[:, None] * closed * push.per_pressure[row]
        offset = slope * (closed @ push.excess[row])
        scale, begin = np.sqrt(weight[row]), start[row] - path[row]
        rival = lsq_linear(
            scale[:, None] * (matrix @ np.tri(NODES)), scale * (offset - matrix @ begin),
            (-reach[row], reach[row]), tol=1e-14, max_iter=2000,
        )  # fmt: skip
        assert np.abs(found[row] - start[row] - np.cumsum(rival.x)).max() < 30.0  # Pa
        torque = push.excess[row] + push.per_pressure[row] * (found[row] - path[row])
        own = response[row] @ (torque + push.per_angle[row] * deviation[row])
        np.testing.assert_allclose(deviation[row], own, atol=1e-12)


def test_iterations_remove_most_of_the_avoidable_cost(monkeypatch):
    given = problem()
    _, path, weight, reach, push, *_ = given

    def costs(iterations):
        monkeypatch.setattr(pushed_path, "ITERATIONS", iterations)
        found, deviation = pushed_path.pushed_path(*given)
        assert np.all(np.abs(np.diff(found, axis=1)) <= reach[:, 1:] * (1.0 + 1e-12))
        error = found - path - push.pressure_per_angle * deviation
        return np.sum(weight * error**2, axis=1)

    usual, first, least = costs(pushed_path.ITERATIONS), costs(0), costs(3000)
    assert np.all(least <= usual)
    assert np.median((usual - least) / (first - least)) < 0.02


def test_rigid_knee_has_the_best_path_of_a_given_angle():
    given = problem(push_scale=0.0)
    start, path, weight, reach, *_ = given
    found, deviation = pushed_path.pushed_path(*given)
    np.testing.assert_allclose(found, best_path(start, path, weight, reach), atol=1e-3)
    assert not deviation.any()


def test_path_stays_within_the_capacity():
    *given, _ = problem()
    free, _ = pushed_path.pushed_path(*given, 1e6)
    most = float(given[0].max())
    assert free.max() > most
    found, _ = pushed_path.pushed_path(*given, most)
    assert 0.0 <= found.min() <= found.max() <= most + 1e-6


def contact_errors(push: bool, monkeypatch) -> np.ndarray:
    """Return the errors [N] in the 0.2 s after heel contact of a walk, a stride a row."""
    if not push:

        def rigid(start, path, weight, reach, *_):
            return best_path(start, path, weight, reach), np.zeros_like(path)

        monkeypatch.setattr(anticipation, "pushed_path", rigid)
    plant = KneeOrthosis.on_leg().without_noise()
    env = make_env("PAM/KneeWalk-v0", plant=plant, strides="identical", episode_seconds=16.0)
    record = rollout(env, built("knee_anticipating", env))
    error, stance = record["output"] - record["reference"], tracked(record)
    contact = np.flatnonzero(stance[1:] & ~stance[:-1]) + 1
    return np.array([error[k : k + 20] for k in contact if 100 < k < len(error) - 20])


def test_push_of_the_knee_halves_the_error_after_heel_contact(monkeypatch):
    pushed, rigid = (contact_errors(push, monkeypatch) for push in (True, False))
    assert len(pushed) == len(rigid) > 1
    assert rms(pushed) < 0.5 * rms(rigid)


@pytest.mark.parametrize("torque", [1e6, -1e6, 40.0])
def test_wrong_plan_of_the_last_period_is_forgotten(torque):
    env = make_env("PAM/KneeStairsUp-v0", episode_seconds=9.0)
    errors = []
    for at in (None, 400):
        controller = built("knee_anticipating", env)
        observation, info = env.reset(seed=4)
        state, over, error = None, False, []
        while not over:
            action, state = controller.predict(observation, state, state is None)
            if len(error) == at:
                state = state._replace(torque=np.full_like(state.torque, torque))
            observation, _, terminated, truncated, info = env.step(action)
            over = terminated or truncated
            gate = min(info["state/stance"], info["sensor/stance"]) > 0.5
            error.append(gate * (info["output"] - info["reference"]))
        errors.append(np.array(error))
    plain, disturbed = errors
    assert len(plain) == len(disturbed)
    np.testing.assert_allclose(rms(disturbed[450:]), rms(plain[450:]), rtol=0.05)
