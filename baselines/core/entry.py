"""Entry of a controller in the catalogue: description, environments, knobs and maker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

from baselines.core.environments import POSITIONING
from baselines.core.knobs import Bounds, Knobs

Knowledge = Literal["nothing", "tables", "nominal model", "true model"]
Maker = Callable[..., Any]
"""``make(plant, signals, action_signals, **options)``; options are ``knobs`` and ``seed``, each
passed only to controllers whose entry declares it."""


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
        From nominal plant, signals and action signals to the controller; see :data:`Maker`.
    preview : bool
        Whether the controller reads the previewed reference samples.
    feedback : bool
        Whether it uses measurements beyond the first of an episode.
    citation : str
        Keys of ``references.bib``, separated by "; "; empty for what needs no source.
    envs : tuple of str
        Ids of the environments that it is for.
    plants : tuple of type
        Classes of nominal plants that the maker accepts; empty if the plant is not used.
    seeded : bool
        Whether the maker takes a random seed.
    kind : str
        "classical": a row of results is verified by running it again.
    tuning : str
        How its numbers were chosen.
    trials : int
        How many settings were tried in simulation to choose them.
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
