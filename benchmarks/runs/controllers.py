"""Controllers of the catalogues of ``baselines`` and, if installed, of ``agents``."""

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from pam_envs.wording import near

ROOT = Path(__file__).resolve().parents[2]


class Controller(Protocol):
    """Policy predictor, in the terms of stable-baselines3."""

    def predict(
        self, observation: Any, state: Any, episode_start: Any, deterministic: bool, /
    ) -> tuple[Any, Any]:
        """Return the action for an observation, and the controller's next state."""
        ...


BY_RULE = "by rule or as published"


@dataclass(frozen=True)
class Entrant:
    """A controller of the board."""

    name: str
    source: str  # module whose make_controller builds it
    # "classical", "learned" or "residual", which is learned on top of a classical one
    kind: str = "classical"
    summary: str = ""
    knowledge: str = "nothing"  # "nothing", "tables", "nominal model" or "true model"
    citation: str = ""
    envs: tuple[str, ...] = ()  # none for any
    # training seed and policy file, relative to the checkout, ascending
    files: tuple[tuple[int, Path], ...] = ()
    trials: int | None = 0  # number of settings tried to choose its numbers, None if unknown
    tuning: str = BY_RULE
    author: str = ""  # empty for those of this package
    tuned: str = ""  # name of the knobs in baselines/core/tuned.yaml
    knobs: tuple[tuple[str, float], ...] = ()  # numbers that a search found
    # names of the signals and actions of a policy's training
    trained_with: tuple[tuple[str, ...], tuple[str, ...]] | None = None

    @property
    def training_seeds(self) -> tuple[int | None, ...]:
        """Training seeds, or only ``None`` for a controller that is not trained."""
        return tuple(seed for seed, _ in self.files) or (None,)

    def runs_in(self, env: str) -> bool:
        """Return whether the controller is for an environment."""
        return not self.envs or env in self.envs


SOURCES = ("baselines.core.catalogue", "agents.policies.catalogue")
"""Modules with ``CONTROLLERS``, entries by name; ``agents`` may be absent."""
_DESCRIBED = ("summary", "knowledge", "citation", "envs", "kind", "trials", "tuning", "author")


def _catalogue(module: str) -> dict[str, Any]:
    try:
        return dict(importlib.import_module(module).CONTROLLERS)
    except ModuleNotFoundError as error:
        if error.name in (module.partition(".")[0], module):
            return {}
        raise


def _entrant(name: str, entry: Any, module: str) -> Entrant | None:
    """Return an entry of a catalogue, ``None`` for a policy that is not trained yet."""
    listed = getattr(entry, "files", None)
    files = tuple(
        (seed, _movable(path)) for seed, path in sorted(listed().items() if listed else ())
    )
    if listed and not files:
        return None
    names = (*_DESCRIBED, "trained_with")
    described = {key: getattr(entry, key) for key in names if hasattr(entry, key)}
    if knobs := tuple(sorted(getattr(entry, "found", {}).items())):
        described |= {"knobs": knobs, "tuned": getattr(entry, "baseline", "") or name}
    return Entrant(name, module, files=files, **described)


def _movable(path: Path) -> Path:
    """Return a path relative to the checkout if it is inside, so that the checkout may move."""
    whole = Path(path).resolve()
    return whole.relative_to(ROOT) if whole.is_relative_to(ROOT) else whole


def available() -> dict[str, Entrant]:
    """Return all controllers by name; raise ValueError if two sources use one name."""
    merged: dict[str, Entrant] = {}
    for module in SOURCES:
        for name, entry in _catalogue(module).items():
            if entrant := _entrant(name, entry, module):
                if name in merged:
                    raise ValueError(
                        f"controller {name!r} is in {merged[name].source} and {module}"
                    )
                merged[name] = entrant
    return merged


def find(name: str) -> Entrant:
    """Return a controller by name; raise ValueError naming the known ones."""
    known = available()
    if name not in known:
        raise ValueError(f"no controller named {name!r}{near(name, sorted(known))}")
    return known[name]


def make(entrant: Entrant, model: Any, env: Any, training_seed: int | None = None) -> Controller:
    """Return a controller built from a nominal plant and the named signals of ``env``.

    ``training_seed`` chooses the policy of a learned one.
    """
    maker = importlib.import_module(entrant.source).make_controller
    base = env.unwrapped
    given = {"plant": model, "signals": base.signals, "action_signals": base.action_signals}
    if training_seed is not None:
        given["training_seed"] = training_seed
    made: Controller = maker(entrant.name, **given)
    return made
