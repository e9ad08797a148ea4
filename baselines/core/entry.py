"""What a catalogue of controllers says of one of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from baselines.core.knobs import Bounds, Knobs

Knowledge = Literal["nothing", "tables", "nominal model", "true model"]


POSITIONING = ("PAM/MusclePositioning-v0",)


@dataclass(frozen=True)
class Entry:
    """A controller of the catalogue.

    Attributes
    ----------
    summary : str
        One line on what it does.
    knowledge : {"nothing", "tables", "nominal model", "true model"}
        What it is told of the muscle; see the catalogue's page on the last two.
    preview : bool
        Whether it reads the previewed reference samples (all that the observation has).
    feedback : bool
        Whether it uses measurements beyond the first of an episode.
    citation : str
        Where the method is from; empty for what needs no source.
    envs : tuple of str
        Environment ids that it is for.
    kind : str
        "classical": a row of results is verified by running it again.
    tuning : str
        How its numbers were chosen.
    trials : int
        How many settings were tried in simulation to choose them.
    knobs : mapping
        What a search may turn, with lowest and highest factor; see :mod:`baselines.core.knobs`.
    found : mapping
        What a search found for them; see :mod:`baselines.core.tuned`.
    author : str
        Who made it, as BibTeX wants it; empty for the authors of this package.
    """

    summary: str
    knowledge: Knowledge
    preview: bool = False
    feedback: bool = False
    citation: str = ""
    envs: tuple[str, ...] = POSITIONING
    kind: str = "classical"
    tuning: str = "by rule or as published"
    trials: int = 0
    knobs: Bounds = field(default_factory=dict, hash=False)
    found: Knobs = field(default_factory=dict, hash=False)
    author: str = ""
