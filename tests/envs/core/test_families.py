"""Kernels of a family in the common step, with three carts that are pushed at once."""

import hashlib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pam_envs.envs.core.arguments import Common, Randomisation
from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.layout import Report, computed
from pam_envs.envs.core.plant_env import PlantEnv
from pam_envs.envs.core.setup import Setup, compose
from pam_envs.envs.core.step import PERIOD
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import normal, uniform

CARTS = 3
PLACE, PUSH, OLD_PUSH, DRIFT = 0, CARTS, 2 * CARTS, 3 * CARTS
MASS = 0
REPORT = Report(
    {**computed("reward", "near", "calm"), "state/drift": DRIFT},
    scratch=0,
    observed=tuple(range(PLACE, PLACE + CARTS)),
)
INFO, ENDED, SIGNALS = REPORT.rows, REPORT.ended, REPORT.signals
FARTHEST = 5.0


@kernel
def drift(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    for j in range(LANES):
        rows[DRIFT][j] = 0.1 * normal(counts[0][j], counts[1][j], 1, counts[3][j])


@kernel
def roll(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any,
) -> None:  # fmt: skip
    for k in range(CARTS):
        for j in range(LANES):
            push = (rows[PUSH + k][j] + rows[DRIFT][j]) / fixed[MASS][j]
            rows[PLACE + k][j] = rows[PLACE + k][j] + settings[0][PERIOD] * push


@kernel
def desired(
    rows: Any, fixed: Any, samples: Any, settings: Any, choices: Any, step: int, lane: int,
    channel: int,
) -> float:  # fmt: skip
    return 0.01 * (channel + 1) * step


@kernel
def judge(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    for j in range(LANES):
        far, change = 0.0, 0.0
        for k in range(CARTS):
            far = max(far, abs(rows[PLACE + k][j]))
            change = change + abs(rows[PUSH + k][j] - rows[OLD_PUSH + k][j])
        work[INFO.reference][j], work[INFO.output][j] = fixed[MASS][j], far
        work[INFO.reward_near][j], work[INFO.reward_calm][j] = -far, -change
        work[ENDED][j] = 1.0 if far > FARTHEST else 0.0


@routine
def begin(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any, j: int,
) -> None:  # fmt: skip
    for k in range(len(rows)):
        rows[k][j] = 0.0
    for k in range(CARTS):
        rows[PLACE + k][j] = uniform(counts[0][j], counts[1][j], 2, k)


def carts() -> Kernels:
    return Kernels(
        f"carts_{hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:12]}",
        carts,
        (),
        REPORT,
        judge,
        begin,
        rows=3 * CARTS + 1,
        parameters=1,
        counts=5,
        set_points=PUSH,
        old_set_points=OLD_PUSH,
        channels=2,
        apply=drift,
        advance=roll,
        reference=desired,
    )


class Plant(SimpleNamespace):
    family, control_period, substeps = "carts", 0.01, 1

    def members(self) -> tuple[Any, ...]:
        return (self,)

    def replace(self, changes: dict[str, float]) -> Any:
        return self

    def needs_effects(self, spread: Any) -> bool:
        return False

    def hysteresis_tables(self) -> np.ndarray:
        return np.zeros((1, 1, 1))

    def parameter_rows(self) -> np.ndarray:
        return np.array([self.mass])


def setup(normalize: bool = True, seconds: float = 0.4) -> Setup:
    drawn = {"cart.mass": (1.0, 3.0)}
    given = Common(None, 4, 3, seconds, normalize=normalize, randomize=drawn)
    return compose(
        Plant(mass=2.0),
        lambda effects: carts(),
        given,
        Randomisation(("cart.mass",), (), ""),
        observation=[(f"place_{k}", "m", -5.0, 5.0) for k in range(CARTS)],
        references=[(name, "m", -5.0, 5.0) for name in ("first", "second")],
        action=[(f"push_{k}", "N", -10.0, 10.0 * (k + 1)) for k in range(CARTS)],
        config={},
    )


def test_each_action_acts_on_its_own_cart() -> None:
    env = PlantEnv(setup(normalize=False))
    observation, info = env.reset(seed=1)
    mass, before = info["reference"], observation[:CARTS].astype(float)
    assert 1.0 < mass < 3.0
    after, reward, *_, info = env.step(np.array([1.0, -2.0, 30.0], np.float32))
    moved = 0.01 * (np.array([1.0, -2.0, 30.0]) + info["state/drift"]) / mass
    assert np.allclose(after[:CARTS] - before, moved, atol=1e-6)
    assert reward == info["reward/near"] + info["reward/calm"]
    assert info["reward/calm"] == -33.0
    assert info["saturated"] == 0.0


@pytest.mark.parametrize("which", range(CARTS))
def test_one_action_out_of_range_is_clipped_and_reported(which: int) -> None:
    env, twin = PlantEnv(setup()), PlantEnv(setup())
    env.reset(seed=2)
    twin.reset(seed=2)
    action = np.zeros(CARTS, np.float32)
    action[which] = 1.0
    edge = twin.step(action)
    action[which] = 4.0
    far = env.step(action)
    assert np.array_equal(edge[0], far[0])
    assert (edge[4]["saturated"], far[4]["saturated"]) == (0.0, 1.0)


def test_channels_have_previews_of_their_own() -> None:
    env = PlantEnv(setup(normalize=False))
    env.reset(seed=0)
    for step in range(1, 8):
        observation, *_ = env.step(np.zeros(CARTS, np.float32))
        steps = step + 3 * np.arange(5)
        assert np.allclose(observation[CARTS : CARTS + 5], 0.01 * steps, atol=1e-6)
        assert np.allclose(observation[CARTS + 5 :], 0.02 * steps, atol=1e-6)


def test_wrong_number_of_actions_lists_their_names() -> None:
    env = PlantEnv(setup())
    env.reset(seed=0)
    for wrong in (np.zeros(2), np.zeros(4), np.zeros((3, 1)), np.float32(0.0)):
        with pytest.raises(ValueError, match="push_0, push_1, push_2"):
            env.step(wrong)
    with pytest.raises(ValueError, match=r"action\[1\] \(push_1\) is nan"):
        env.step(np.array([0.0, np.nan, 0.0]))


def test_limit_ends_the_episode() -> None:
    env = PlantEnv(setup(seconds=60.0))
    env.reset(seed=0)
    steps = 0
    terminated = False
    while not terminated:
        _, _, terminated, truncated, info = env.step(np.ones(CARTS, np.float32))
        assert not truncated
        steps += 1
    assert info["output"] > FARTHEST
    assert steps < 200
