"""One rule of actions: finite, unmasked numbers of the right shape, and nothing else."""

import datetime
import decimal
import fractions
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch

from tests.envs.cases import IDS

KINDS = ("?", "i1", "i8", "u2", "u8", "f2", "f4", "f8", "g")
OTHER_KINDS = ("O", "c8", "M8[ns]", "m8[ns]", "m8[s]", "U4", "S2", "V8", [("a", "f8")])


class Number:
    """An object that converts to a number, and to an array."""

    def __float__(self) -> float:
        return 0.5

    def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
        return np.full(1, 0.5)

    def tolist(self) -> list[float]:
        return [0.5]


class Broken:
    """An object that raises whatever is asked of it."""

    def __getattr__(self, name: str) -> Any:
        raise RuntimeError(name)

    def __repr__(self) -> str:
        raise RuntimeError("repr")

    def __len__(self) -> int:
        raise RuntimeError("len")


OTHERS: tuple[Callable[[], Any], ...] = (
    Number,
    Broken,
    lambda: 10**400,
    lambda: -(10**5000),
    lambda: 1j,
    lambda: decimal.Decimal("0.5"),
    lambda: fractions.Fraction(1, 2),
    lambda: datetime.date(2000, 1, 1),
    lambda: np.datetime64("2000-01-01"),
    lambda: np.timedelta64(3, "s"),
    lambda: np.ma.masked,
    lambda: None,
    lambda: "0.5",
    lambda: b"1",
    lambda: np.nan,
    lambda: -np.inf,
    lambda: np.str_("1"),
    lambda: [],
    lambda: [0.5],
    lambda: {},
)
"""Values that are no finite number."""


def numbers(random: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Return an array of finite numbers of a drawn type."""
    kind = np.dtype(random.choice(KINDS[:-1]) if random.random() < 0.9 else "g")
    return (2.0 * random.random(shape)).astype(kind)


def action(random: np.random.Generator, shape: tuple[int, ...]) -> tuple[Any, bool]:
    """Return a drawn object, and whether it is an action of a shape."""
    good = numbers(random, shape)
    place = tuple(int(random.integers(n)) for n in shape)
    case = int(random.integers(10))
    if case == 0:
        return good, True
    if case == 1:
        return good.tolist(), good.dtype.kind != "g"
    if case == 2:
        return [*good] if random.random() < 0.5 else tuple(good), True
    if case == 3:
        return good[..., ::-1] if random.random() < 0.5 else np.asfortranarray(good), True
    if case == 4:
        broken = good.astype(float)
        broken[place] = random.choice([np.nan, np.inf, -np.inf])
        return (broken if random.random() < 0.5 else broken.tolist()), False
    if case == 5:
        wrong = tuple(int(n) for n in random.integers(0, 4, random.integers(0, 4)))
        made = numbers(random, wrong)
        return made if random.random() < 0.5 else made.tolist(), wrong == shape
    if case == 6:
        cast = OTHER_KINDS[int(random.integers(len(OTHER_KINDS)))]
        return np.zeros(shape, cast), False
    if case == 7:
        masked = np.ma.MaskedArray(good, mask=random.random(shape) < 0.5)
        return masked, False
    if case == 8:
        rows = good.astype(float).tolist()
        inner: Any = rows
        for k in place[:-1]:
            inner = inner[k]
        inner[place[-1]] = OTHERS[int(random.integers(len(OTHERS)))]()
        return rows, False
    tensor = torch.zeros(shape, requires_grad=bool(random.integers(2)))
    others = [Number(), Broken(), tensor, "up", b"\0" * 8, None, {}, set(), range(shape[-1])]
    others += [iter([0.5]), memoryview(b"1"), lambda: 0.5, float, [[0.5], [0.5, 0.5]]]
    return others[int(random.integers(len(others)))], False


@pytest.mark.parametrize("name", IDS)
def test_drawn_actions_step_or_raise_value_error_and_change_nothing(name: str) -> None:
    random = np.random.default_rng(IDS.index(name))
    env = gym.make(name).unwrapped
    envs = gym.make_vec(name, 2, vectorization_mode="vector_entry_point")
    for which, word in ((env, "action "), (envs, "actions ")):
        which.reset(seed=0)
        for _ in range(300):
            drawn, good = action(random, which.action_space.shape)
            before = which.get_state()
            if good:
                which.step(drawn)
                continue
            with pytest.raises(ValueError, match=f"^{word.strip()}") as error:
                which.step(drawn)
            assert len(str(error.value)) < 1000
            after = which.get_state()
            assert all(np.array_equal(after[key], before[key]) for key in before)


@pytest.mark.parametrize("kind", KINDS)
def test_every_type_of_number_gives_the_same_step(kind: str) -> None:
    env, twin = (gym.make("PAM/RedundantManipulator-v0").unwrapped for _ in range(2))
    for given in (np.ones(6, kind), [np.dtype(kind).type(1)] * 6):
        env.reset(seed=0)
        twin.reset(seed=0)
        assert np.array_equal(env.step(given)[0], twin.step(np.ones(6))[0])


def test_message_names_the_type_that_was_given() -> None:
    env = gym.make("PAM/AntagonisticJoint-v0").unwrapped
    env.reset(seed=0)
    n = env.action_space.shape[0]
    with pytest.raises(ValueError, match=r"datetime64\[ns\]"):
        env.step(np.zeros(n, "M8[ns]"))
    with pytest.raises(ValueError, match=r"MaskedArray"):
        env.step(np.ma.zeros(n))
    with pytest.raises(ValueError, match=r"Tensor; convert it with numpy\.asarray"):
        env.step(torch.zeros(n))
