"""Episodes: failures of the controller, errors of the environment, and rows of a batch."""

from functools import partial
from itertools import chain

import numpy as np
import pytest

from benchmarks.runs import controllers, rollout
from benchmarks.scenarios.scenario_env import make_batch, make_env

SHORT = {"episode_seconds": 0.2}


class Gives:
    """A controller that gives one thing, or raises it."""

    def __init__(self, thing):
        self.thing = thing

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        if isinstance(self.thing, Exception):
            raise self.thing
        return self.thing, None


@pytest.fixture
def env():
    made = make_env("PAM/MusclePositioning-v0", SHORT)
    yield made
    made.close()


def test_episode_that_reaches_its_end_is_no_failure(env):
    episode = rollout.run(env, Gives(np.zeros(1, np.float32)), 1)
    assert (episode.failed, len(episode.actions)) == (False, 20)


@pytest.mark.parametrize(
    ("thing", "words"),
    [
        (np.array([np.nan]), "ValueError"),
        (np.zeros(2), "ValueError"),
        ("full", "ValueError"),
        (None, ""),
        ({"pressure": 1.0}, ""),
        (TypeError("not so"), "TypeError: not so"),
        (RuntimeError("line\n  two at 0x7f001122aabb"), "RuntimeError: line two at 0x..."),
    ],
)
def test_failure_of_a_controller_is_recorded_with_its_message(env, thing, words):
    episode = rollout.run(env, Gives(thing), 1)
    assert episode.failed
    assert episode.failure.startswith(words)
    assert len(episode.actions) == 0


def test_long_message_is_truncated(env):
    episode = rollout.run(env, Gives(RuntimeError("x" * 10_000)), 1)
    assert len(episode.failure) == rollout.LONGEST
    assert episode.failure.endswith("...")


@pytest.mark.parametrize("error", [ValueError("ours"), KeyError("ours"), TypeError("ours")])
def test_error_of_the_environment_is_raised(env, error, monkeypatch):
    def broken(action):
        raise error

    monkeypatch.setattr(env.unwrapped, "step", broken)
    with pytest.raises(type(error), match="ours"):
        rollout.run(env, Gives(np.zeros(1, np.float32)), 1)


# --- several at once ---------------------------------------------------------------------------

SEEDS = (7, 1, 12, 30)
SWINGS = {"reference": "path_2", "path_seconds": 0.6, "rest_seconds": 0.2, "episode_seconds": 1.5}


class Rows:
    """A controller whose row is a function of that row, and of the others by ``mixed``."""

    def __init__(self, mixed=0.0, alone=True, swing=0):
        self.mixed, self.alone, self.swing, self.batches = mixed, alone, swing, 0

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        rows = np.atleast_2d(observation)
        if len(rows) > 1:
            self.batches += 1
            if not self.alone:
                raise TypeError("one at a time")
        step = np.zeros(len(rows)) if state is None else np.where(episode_start, 0, state + 1)
        value = np.tanh(rows[:, [0]] + self.mixed * rows.mean())
        if self.swing:
            value = np.sign(rows[:, [0]]) * (-1.0) ** (step[:, None] // self.swing)
        action = np.repeat(value, 10 if self.swing else 1, axis=1).astype(np.float32)
        return (action if np.ndim(observation) == 2 else action[0]), step


def compared(env_id, kwargs, controller, seeds=SEEDS):
    """Return episodes run together, after comparing them with single ones."""
    return compared_parts([part_of(env_id, kwargs, seeds)], controller)[0]


def part_of(env_id, kwargs, seeds=SEEDS, make=None):
    """Return the episodes of an environment with these arguments as a part of a batch."""
    made = make or partial(make_batch, env_id, kwargs)
    return rollout.Part(made, make_env(env_id, kwargs), seeds)


def compared_parts(parts, controller):
    """Return episodes of parts run together, after comparing them with single ones."""
    together = rollout.run_all(parts, controller)
    assert [len(own) for own in together] == [len(part.seeds) for part in parts]
    whole = [(part.env, seed) for part in parts for seed in part.seeds]
    for episode, (env, seed) in zip(chain(*together), whole, strict=True):
        alone = rollout.run(env, controller, seed)
        assert (episode.failure, episode.period) == (alone.failure, alone.period)
        assert list(episode.signals) == list(alone.signals)
        for name, signal in alone.signals.items():
            np.testing.assert_array_equal(episode.signals[name], signal, err_msg=name)
        for name in ("observations", "actions"):
            mine, other = getattr(episode, name), getattr(alone, name)
            assert mine.dtype == other.dtype
            np.testing.assert_array_equal(mine, other)
    return together


@pytest.mark.parametrize(
    ("env_id", "name", "kwargs"),
    [
        ("PAM/MusclePositioning-v0", "inverse_pid", {"episode_seconds": 2.0, "load": None}),
        ("PAM/AntagonisticJoint-v0", "joint_mfc_mu", {"episode_seconds": 2.0}),
        ("PAM/KneeWalk-v0", "knee_inverse_ahead_ltr", {}),
        ("PAM/RedundantManipulator-v0", "joint_random", {"episode_seconds": 1.0}),
    ],
)
def test_rows_of_a_batch_are_single_episodes_to_the_bit(env_id, name, kwargs, monkeypatch):
    env = make_env(env_id, kwargs)
    controller = controllers.make(controllers.find(name), env.unwrapped.plant, env)
    compared(env_id, kwargs, controller)
    monkeypatch.setattr(rollout, "run", None)  # not needed
    (episodes,) = rollout.run_all([part_of(env_id, kwargs, (3, 4))], controller)
    assert len(episodes) == 2


class ByRow:
    """A controller whose action is a function of the row's number."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        rows = np.arange(len(np.atleast_2d(observation)), dtype=np.float32)[:, None]
        action = np.cos(rows)
        return (action if np.ndim(observation) == 2 else action[0]), None


def test_controller_that_acts_by_row_gets_batches_of_one(monkeypatch):
    env_id = "PAM/MusclePositioning-v0"
    controller = ByRow()
    first, *others = compared(env_id, SHORT, controller)
    assert all(np.array_equal(first.actions, other.actions) for other in others)
    monkeypatch.setattr(rollout, "run", None)  # not needed
    rows = []
    batches = partial(make_batch, env_id, SHORT)
    noted = part_of(env_id, SHORT, (3, 4), lambda n: rows.append(n) or batches(n))
    rollout.run_all([noted], controller)
    assert rows == [2, 1, 1]


@pytest.mark.parametrize(
    ("controller", "batches"),
    [(Rows(), 20), (Rows(mixed=1.0), 20), (Rows(alone=False), 1)],
    ids=["rows", "mixed", "takes no batch"],
)
def test_controller_whose_rows_depend_on_each_other_is_run_alone(controller, batches):
    compared("PAM/MusclePositioning-v0", SHORT, controller)
    assert controller.batches == batches


class Counting(Rows):
    """A controller whose action depends on the step of the episode of each row."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        action, step = super().predict(observation, state, episode_start, deterministic)
        turn = np.cos(0.3 * step).astype(np.float32)
        return action * (turn[:, None] if np.ndim(observation) == 2 else turn), step


def test_parts_of_a_batch_end_independently():
    env_id = "PAM/MusclePositioning-v0"
    steps = {**SHORT, "reference": "steps"}
    parts = [
        part_of(env_id, SHORT, (5, 2, 9)),
        part_of(env_id, {**steps, "episode_seconds": 3.0}, (2,)),
        part_of(env_id, {**steps, "randomize": True}, (4, 4)),
    ]
    controller = Counting()
    first, second, third = compared_parts(parts, controller)
    lengths = [{len(episode.actions) for episode in own} for own in (first, second, third)]
    assert lengths == [{20}, {300}, {20}]
    assert controller.batches == 300
    signals = rollout.run_all([parts[1]], controller)[0][0].signals
    assert all(np.array_equal(second[0].signals[name], signals[name]) for name in signals)


class Beside(Rows):
    """A controller whose second row depends on the first one."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        action, step = super().predict(observation, state, episode_start, deterministic)
        if np.ndim(observation) == 2 and len(observation) > 1:
            action[1] = action[0]
        return action, step


def test_part_in_the_middle_whose_rows_are_not_its_own_is_found():
    env_id = "PAM/MusclePositioning-v0"
    parts = [part_of(env_id, SHORT, (seed,)) for seed in (5, 2, 9)]
    controller = Beside()
    together = [*chain(*compared_parts(parts, controller))]
    assert controller.batches == 20
    assert [len(episode.actions) for episode in together] == [20, 20, 20]


def test_rows_of_a_batch_end_independently():
    together = compared("PAM/RedundantManipulator-v0", SWINGS, Rows(swing=25))
    lengths = [len(episode.actions) for episode in together]
    assert all(episode.failed for episode in together)
    assert min(lengths) < 150


@pytest.mark.parametrize("thing", [np.array([np.nan]), np.zeros(2), RuntimeError("no")])
def test_failure_in_a_batch_has_the_message_of_a_single_episode(thing):
    together = compared("PAM/MusclePositioning-v0", SHORT, Gives(thing))
    assert all(episode.failed for episode in together)


def test_actions_are_timed_for_single_observations():
    (episode, *_) = compared("PAM/MusclePositioning-v0", SHORT, Rows())
    assert len(episode.seconds) == 2 * 20
    assert (episode.seconds > 0.0).all()


def test_error_of_the_batch_is_raised():
    env_id = "PAM/MusclePositioning-v0"

    def broken(rows):
        batch = make_batch(env_id, SHORT, rows)

        def step(action):
            raise ValueError("ours")

        batch.step = step
        return batch

    with pytest.raises(ValueError, match="ours"):
        rollout.run_all([part_of(env_id, SHORT, make=broken)], Rows())


@pytest.mark.parametrize(
    ("controller", "answers"), [(Rows(mixed=1.0), 3), (Rows(alone=False), 2)], ids=["rows", "alone"]
)
def test_cancelled_run_ends_before_its_next_episode(controller, answers, monkeypatch):
    env_id = "PAM/MusclePositioning-v0"
    asked = iter([*[True] * answers, False])
    monkeypatch.setattr(rollout, "is_needed", lambda: next(asked))
    with pytest.raises(RuntimeError, match="cancelled"):
        rollout.run_all([part_of(env_id, SHORT)], controller)
    assert not [*asked]


@pytest.mark.parametrize(
    ("env_id", "name", "reference", "seconds"),
    [
        ("PAM/MusclePositioning-v0", "inverse_no_preview", "sines", 0.0),
        ("PAM/AntagonisticJoint-v0", "joint_mfc_mu_ahead", "sine", 0.16),
        ("PAM/RedundantManipulator-v0", "joint_mfc_mu_ahead", "path_1", 0.15),
    ],
)
def test_preview_in_use_is_measured_in_seconds(env_id, name, reference, seconds):
    kwargs = {"episode_seconds": 1.0, "reference": reference}
    env = make_env(env_id, kwargs)
    controller = controllers.make(controllers.find(name), env.unwrapped.plant, env)
    episode = rollout.run(env, controller, 5)
    assert rollout.preview_used(episode, controller, env.unwrapped.signals) == seconds
