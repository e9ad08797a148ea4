"""The one place where controllers come from: ``baselines`` and, where installed, ``agents``."""

from __future__ import annotations

import importlib
import inspect
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from benchmarks.canonical import object_digest, sources_digest

ROOT = Path(__file__).resolve().parent.parent


class Controller(Protocol):
    """What stable-baselines3 calls a policy predictor."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Any, Any]:
        """Return the action for an observation, and the controller's next state."""
        ...


@dataclass(frozen=True)
class Entrant:
    """A controller as the board names it.

    Attributes
    ----------
    name, summary, knowledge, citation : str
        ``knowledge`` is "nothing", "tables", "nominal model" or "true model".
    envs : tuple of str
        Ids that it runs in; empty means any.
    kind : {"classical", "learned"}
        Learned ones are verified by replaying their recorded actions.
    source : str
        Module whose ``make_controller`` builds it.
    """

    name: str
    summary: str
    knowledge: str
    citation: str
    envs: tuple[str, ...]
    kind: str
    source: str

    def runs_in(self, env: str) -> bool:
        """Return whether the controller is meant for an environment."""
        return not self.envs or env in self.envs


SOURCES = (
    ("baselines.catalogue", "baselines", "classical"),
    ("agents.catalogue", "agents", "learned"),
)
"""Module, its package, and the kind of its controllers. ``agents`` may be absent."""


def _entrants(module: str, package: str, kind: str) -> dict[str, Entrant]:
    try:
        found = importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name in (package, module):
            return {}
        raise
    return {
        name: Entrant(
            name=name,
            summary=str(getattr(entry, "summary", "")),
            knowledge=str(getattr(entry, "knowledge", "nothing")),
            citation=str(getattr(entry, "citation", "")),
            envs=tuple(getattr(entry, "envs", ()) or ()),
            kind=str(getattr(entry, "kind", kind)),
            source=module,
        )
        for name, entry in found.CONTROLLERS.items()
    }


def available() -> dict[str, Entrant]:
    """Return all controllers by name.

    Raises
    ------
    ValueError
        If two sources use one name.
    """
    merged: dict[str, Entrant] = {}
    for source in SOURCES:
        for name, entrant in _entrants(*source).items():
            if name in merged:
                raise ValueError(f"controller {name!r} is in {merged[name].source} and {source[0]}")
            merged[name] = entrant
    return merged


def find(name: str) -> Entrant:
    """Return a controller by name, or raise naming the nearest ones."""
    known = available()
    if name not in known:
        raise ValueError(f"no controller named {name!r}; there are: {', '.join(sorted(known))}")
    return known[name]


def make(entrant: Entrant, model: Any, env: Any, seed: int = 0) -> Controller:
    """Return a controller built from a nominal plant and the named signals.

    Parameters
    ----------
    entrant : Entrant
    model : object
        The plant that the controller is told.
    env : gymnasium.Env
        Only its named signals are used, never its plant.
    seed : int
        For controllers that draw.
    """
    maker = importlib.import_module(entrant.source).make_controller
    base = env.unwrapped
    made: Controller = maker(
        entrant.name,
        plant=model,
        signals=base.signals,
        action_signals=base.action_signals,
        seed=seed,
    )
    return made


def parameters_digest(controller: Controller) -> str:
    """Return a digest of all that the controller holds."""
    return object_digest(controller)


def source_digest(entrant: Entrant) -> str:
    """Return a digest of the package that the controller comes from."""
    module = inspect.getfile(importlib.import_module(entrant.source))
    return sources_digest([Path(module).parent])
