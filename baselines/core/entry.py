"""Catalogue entry of a controller, the specification for its design, and its knobs.

A rule or a paper fixes most parameters of a controller from the nominal plant, and leaves some
free, such as the bandwidth of the closed loop or the lead of the preview. A *knob* is a factor on
one of them; a factor of 1 gives the published or rule-based value to the last bit. An entry of the
catalogue declares its knobs with their bounds (``Entry.knobs``); makers read them by ``Spec.knob``.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Generic, Literal, TypeVar

from pam_envs.parameters import Signals

P = TypeVar("P")
POSITIONING = ("PAM/MusclePositioning-v0",)
BRACE = ("PAM/KneeTension-v0", "PAM/KneeStiffness-v0")
GAIT = ("PAM/KneeWalk-v0", "PAM/KneeStairsUp-v0", "PAM/KneeStairsDown-v0")
KNEE = (*BRACE, *GAIT)
ELBOW = ("PAM/ElbowOrthosis-v0",)
ARM = ("PAM/RedundantManipulator-v0",)
JOINT = ("PAM/AntagonisticJoint-v0", *ARM)

SUFFIXES: Mapping[str, str] = {
    "PAM/KneeTension-v0": "tension",
    "PAM/KneeStiffness-v0": "stiffness",
    "PAM/KneeWalk-v0": "walk",
    "PAM/KneeStairsUp-v0": "stairs_up",
    "PAM/KneeStairsDown-v0": "stairs_down",
    "PAM/AntagonisticJoint-v0": "joint",
    "PAM/RedundantManipulator-v0": "arm",
}
"""Suffix of a tuned controller's name, for controllers that run in several environments."""

Knobs = Mapping[str, float]
Bounds = Mapping[str, tuple[float, float]]
"""Lowest and highest value by knob; 1 lies between them."""

AS_DESIGNED: Knobs = MappingProxyType({})

Plants = Literal["nominal", "drawn"]
"""Plants of a search over knobs: the nominal one, or one drawn in each episode."""

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
        Lowest and highest factor of each knob; see the module.
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


def check_knobs(controller: str, bounds: Bounds, knobs: Knobs) -> None:
    """Raise unless a controller has these knobs and every factor is within its bounds."""
    for name, value in knobs.items():
        if name not in bounds:
            there = f"choose from {', '.join(bounds)}" if bounds else "it has none: leave knobs out"
            raise ValueError(f"{controller} has no knob {name!r}; {there}")
        low, high = bounds[name]
        if not low <= value <= high:
            raise ValueError(
                f"{controller}: knob {name} is {value!r}, outside {low:g} to {high:g}; "
                "give a factor in that range, 1 for the number as designed"
            )
