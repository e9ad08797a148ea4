"""Recorded actions of a learned row, played again: a check that no rounding disturbs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.identity import tolerance as nearly
from benchmarks.identity.hashing import plain
from benchmarks.runs import cells, controllers, rollout
from benchmarks.runs.cells import Cell, cells_of
from benchmarks.runs.controllers import Entrant
from benchmarks.scenarios.scenario import ScenarioSet
from benchmarks.scenarios.scenario_env import make_env, model_of

EQUAL = 1e-9
"""Relative difference of a score from equal actions on another machine."""
ANSWERED = 1e-3
"""Part of an action's range by which a policy may answer otherwise on another machine."""


class Questioned:
    """Gives recorded actions and notes by how much a controller would have answered otherwise.

    Attributes
    ----------
    off : float
        Largest difference, in parts of the action's range.
    """

    def __init__(self, controller: Any, actions: NDArray[Any], span: NDArray[Any]) -> None:
        self.controller, self.actions, self.span = controller, actions, span
        self.off = 0.0

    @property
    def model_output(self) -> Callable[[Any], Any]:
        """What the controller's model says; an ``AttributeError`` where it has none."""
        told: Callable[[Any], Any] = self.controller.model_output
        return lambda state: told(state[1])

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Any, Any]:
        """Return the next recorded action; the controller sees what it would have seen."""
        step, inner = (0, None) if state is None or episode_start else state
        answer, inner = self.controller.predict(observation, inner, episode_start, deterministic)
        given = self.actions[step]
        self.off = max(self.off, float(np.max(np.abs(np.asarray(answer) - given) / self.span)))
        return given, (step + 1, inner)


def differences(stored: Mapping[str, Any], entrant: Entrant, track: ScenarioSet) -> list[str]:
    """Return what the recorded actions of a row give otherwise than recorded.

    Scores must agree to 1e-9, or to 1e-12 of the worst case where they are next to nothing, and
    the policy must answer with the recorded actions to a thousandth of their range.
    """
    found = []
    for cell in cells_of(entrant, track):
        if cell.first:
            found += _differences(stored, cell)
    return found


def _differences(stored: Mapping[str, Any], cell: Cell) -> list[str]:
    packed = stored["actions"].get(cell.scenario.name, {})
    recorded = {int(seed): cells.unpack(actions) for seed, actions in packed.items()}
    if set(recorded) != {cell.seeds[0]}:
        return [f"actions.{cell.scenario.name}: not of seed {cell.seeds[0]} alone"]
    ((seed, actions),) = recorded.items()
    old = next(episode for episode in stored["episodes"] if _is(episode, cell, seed))
    new, off = play(cell, seed, actions)
    where = f"replayed {cell.scenario.name}, seed {seed}"
    slack = nearly.slack_of(stored)
    lines = [] if off <= ANSWERED else [f"{where}: the policy answers otherwise by {off:.2g}"]
    for name, value in old["scores"].items():
        now, near_zero = plain(new["scores"][name]), nearly.SLACK * slack[name]
        lines += nearly.differences(value, now, f"{where}, {name}", EQUAL, near_zero)
    return lines


def _is(episode: Mapping[str, Any], cell: Cell, seed: int) -> bool:
    mine = (cell.split, cell.training_seed, cell.scenario.name, seed)
    place = ("split", "training_seed", "scenario", "seed")
    return tuple(episode[key] for key in place) == mine


def play(cell: Cell, seed: int, actions: NDArray[Any]) -> tuple[dict[str, Any], float]:
    """Return the record of an episode of recorded actions, and how far the policy is from them."""
    env = make_env(cell.track.env, cell.scenario.kwargs)
    model = model_of(cell.track.env, cell.scenario, env)
    controller = controllers.make(cell.entrant, model, env, training_seed=cell.training_seed)
    span = env.action_space.high - env.action_space.low
    asked = Questioned(controller, actions, span)
    episode = rollout.run(env, asked, seed)
    env.close()
    return cells.episode_record(cell, seed, episode), asked.off
