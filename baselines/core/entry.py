"""Catalogue entry of a controller, and the specification for its design."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, Literal, TypeVar

from baselines.core.environments import POSITIONING
from baselines.core.knobs import Bounds, Knobs
from pam_envs.parameters import Signals

P = TypeVar("P")
Knowledge = Literal["nothing", "tables", "nominal model", "true model"]


@dataclass(frozen=True)
class Spec(Generic[P]):
    """Specification from which a maker designs a controller.

    Attributes
    ----------
    plant : Plant
        Nominal plant.
    signals, actions : Signals
        Those of the environment.
    knobs : mapping of float
        Factors on the knobs of the entry; 1 if omitted.
    seed : int
        For controllers that draw random numbers.
    """

    plant: P
    signals: Signals
    actions: Signals
    knobs: Knobs = field(default_factory=dict)
    seed: int = 0

    def knob(self, name: str) -> float:
        """Return a knob's factor, 1 if it is not set."""
        return self.knobs.get(name, 1.0)


Maker = Callable[[Spec[Any]], Any]


@dataclass(frozen=True)
class Entry:
    """A controller of the catalogue.

    Attributes
    ----------
    summary : str
        One line on the method.
    knowledge : {"nothing", "tables", "nominal model", "true model"}
        Model knowledge; see :mod:`baselines.core.catalogue` on the last two.
    make : callable
        From a :class:`Spec` to the controller.
    preview : bool
        Whether the controller reads the previewed reference samples.
    feedback : bool
        Whether it uses measurements beyond the first of an episode.
    citation : str
        Keys of ``references.bib``, separated by "; "; empty if no source is needed.
    envs : tuple of str
        Ids of the environments of the controller.
    plants : tuple of type
        Classes of nominal plants that the maker accepts; empty if the plant is not used.
    seeded : bool
        Whether the controller draws random numbers.
    kind : str
        "classical": a row of results is verified by running it again.
    tuning : str
        Method by which its numbers were chosen.
    trials : int
        Number of settings tried in simulation to choose them.
    knobs : mapping
        Lowest and highest factor of each knob; see :mod:`baselines.core.knobs`.
    found : mapping
        Factors found by a search; see :mod:`baselines.core.tuned`.
    author : str
        Author as in BibTeX; empty for the authors of this package.
    """

    summary: str
    knowledge: Knowledge
    make: Maker
    preview: bool = False
    feedback: bool = False
    citation: str = ""
    envs: tuple[str, ...] = POSITIONING
    plants: tuple[type, ...] = ()
    seeded: bool = False
    kind: str = "classical"
    tuning: str = "by rule or as published"
    trials: int = 0
    knobs: Bounds = field(default_factory=dict, hash=False)
    found: Knobs = field(default_factory=dict, hash=False)
    author: str = ""
