"""Pages of the environments agree with the code in signals, info and arguments."""

import ast
import importlib
import inspect
import re
from pathlib import Path

import gymnasium as gym
import pytest

from tests.envs.cases import IDS

DOCS = Path(__file__).resolve().parents[3] / "docs" / "envs"
PAGES = [path for path in DOCS.glob("*.md") if path.stem != "index"]
FIXED_BY_THE_ID = {"activity", "quantity", "mounting"}
EVERY = pytest.mark.parametrize("name", IDS)


def page(name: str) -> str:
    """Return the name of the page that lists an id before its first picture."""
    (found,) = [p.stem for p in PAGES if f"`{name}`" in p.read_text().split("![")[0]]
    return found


def table(name: str, heading: str) -> list[list[str]]:
    """Return the cells of the first table below a heading, without its head."""
    text = (DOCS / f"{page(name)}.md").read_text().split(f"\n## {heading}\n")[1]
    rows = re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE)[0].splitlines()[2:]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", row)[1:-1]] for row in rows]


def quoted(cell: str) -> list[str]:
    return re.findall(r"`([^`]+)`", cell)


def named(cell: str) -> list[str]:
    """Return the signals of a row: those in quotes at its beginning, or its first word."""
    return quoted(re.match(r"(`\w+`,? ?)*", cell)[0]) or [re.split(r"[ ,:;]", cell)[0]]


@EVERY
def test_page_states_the_spaces(name: str) -> None:
    text = (DOCS / f"{page(name)}.md").read_text()
    env = gym.make(name).unwrapped
    assert f"| Action space | `Box(-1, 1, {env.action_space.shape}, float32)` |" in text
    assert f"| Observation space | `Box(-1, 1, {env.observation_space.shape}, float32)`" in text


@EVERY
def test_signals_are_listed_in_order(name: str) -> None:
    env = gym.make(name, preview=0).unwrapped
    first = [word for row in table(name, "Observation") for word in named(row[1])]
    coming = {s.name for s in gym.make(name, preview=1).unwrapped.signals if s.ahead > 0.0}
    assert [n for n in first if n and n not in coming] == list(env.signals.names())
    rows = table(name, "Action")
    assert [word for row in rows for word in named(row[1])] == list(env.action_signals.names())
    for row in rows:
        for word in named(row[1]):
            action = env.action_signals[word]
            assert (float(row[3]), float(row[4]), row[2]) == (action.low, action.high, action.unit)


@EVERY
def test_page_states_ranges_and_units_of_signals(name: str) -> None:
    env = gym.make(name, preview=0).unwrapped
    for row in table(name, "Observation"):
        for word in named(row[1]):
            if word in env.signals.names() and " or " not in row[3] + row[4]:
                signal = env.signals[word]
                said = (float(row[3]), float(row[4]), row[2])
                assert said == (signal.low, signal.high, signal.unit)


@EVERY
def test_page_lists_every_info_key(name: str) -> None:
    listed = [key for row in table(name, "Info") for key in quoted(row[0])]
    assert len(listed) == len(set(listed))
    assert set(listed) == set(gym.make(name).unwrapped.setup.info_keys)


@EVERY
def test_page_lists_arguments_and_defaults(name: str) -> None:
    module = importlib.import_module(str(gym.spec(name).entry_point).partition(":")[0])
    taken = inspect.signature(module.make_setup).parameters
    listed = {}
    for row in table(name, "Arguments"):
        names = quoted(row[0])
        values = row[1].split(", ") if len(names) > 1 else [row[1]]
        listed |= dict(zip(names, values, strict=True))
    assert set(listed) == set(taken) - FIXED_BY_THE_ID
    for argument, said in listed.items():
        default = taken[argument].default
        try:
            value = ast.literal_eval(said.strip("`"))
        except (SyntaxError, ValueError):
            continue  # words, or nothing
        resolved = {
            "hysteresis": "maxwell_slip", "pace": "slow", "strides": "varied",
            "hysteresis_drive": "pressure" if "Knee" in name else "length",
            "wearer": "prescribed", "lean": "shank", "air": "regulator",
        }.get(argument)  # fmt: skip
        assert value == (resolved if default is None and resolved else default), argument
