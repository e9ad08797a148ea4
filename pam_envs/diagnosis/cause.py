"""Cause of model error: an effect that a plain plant has switched off, and its signature."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pam_envs.wording import near

NEEDS = {
    "contraction": "`contraction_mm`",
    "pressure": "`pressure_bar`",
    "loads": "`load_N` with two loads or more",
    "weighed": "loads with a declared tolerance (`tolerance: {mass.load}` in RIG.yaml)",
    "temperature": "varying `temperature_C`",
    "valve_closed": "a segment with the valve closed (`valve_closed` in RIG.yaml)",
    "rest": "a rested muscle at the start (`cycles_since_rest` in RIG.yaml)",
    "command": "commanded pressures",
    "exhaust": "a command that falls by more than 0.5 bar",
}
"""Requirements of a cause on a recording, in words."""


@dataclass(frozen=True)
class Term:
    """A parameter of a form."""

    name: str  # dotted name of the plant's parameter
    starts: tuple[float, ...]  # starting values [SI]; several terms start at the i-th of each
    low: float | None = None  # bounds narrower than those of the parameter's declaration
    high: float | None = None
    scale: float | None = None  # size of a meaningful change
    log: bool = False  # fitted on a logarithmic scale
    amount: bool = True  # whether the effect vanishes with it; other terms only shape the effect
    prior: float = np.inf  # standard deviation about the start, in scales; e-folds if logarithmic


@dataclass(frozen=True)
class Form:
    """One mathematical form of a cause."""

    name: str  # one or two words
    terms: tuple[Term, ...]
    # search for starting values from the base's fit, instead of those of the terms
    # (pam_envs.diagnosis.fit.starting_values)
    search: Callable[..., Sequence[Sequence[float]]] | None = None
    title: str = ""  # replaces that of the cause, where it claims more than the form shows

    def start(self, k: int) -> list[float]:
        """Return the ``k``-th starting value of each term, the last one of those with fewer."""
        return [t.starts[min(k, len(t.starts) - 1)] for t in self.terms]

    @property
    def starts(self) -> list[tuple[float, ...]]:
        """Starting points by the terms."""
        return [tuple(self.start(k)) for k in range(max(len(t.starts) for t in self.terms))]

    @property
    def trials(self) -> int:
        """Number of starting points among which the best is selected."""
        own = len(self.starts)
        return int(getattr(self.search, "trials", own)) if self.search is not None else own


@dataclass(frozen=True)
class Cause:
    """An effect that a plant may lack."""

    name: str  # in the report
    title: str  # name in a sentence, "creep of the muscle"
    forms: tuple[Form, ...]  # rival mathematical forms; the best one counts
    signature: str = ""  # appearance in a residual
    neighbours: tuple[str, ...] = ()  # causes with a similar signature
    experiment: str = ""  # experiment that separates it from them
    source: str = ""  # source of the physics
    needs: tuple[str, ...] = ()  # words of NEEDS: requirements on a recording that can decide it
    # whether rigs commonly differ in it from the base plant: it is part of the flexible base, and
    # other causes are judged by what is left
    common: bool = False
    by_nature: bool = False  # whether such a difference is no fault, and named at a small gain
    # whether it changes the static law or the width of the hysteresis, as another muscle would: on
    # a rig that differs from the base in these, it is named only at a large gain
    lawlike: bool = False
    once: bool = False  # it happens once, so that held-out kinds of segment need not show it
    sensor: str = ""  # sensor that would measure it directly
    contains: tuple[
        str, ...
    ] = ()  # causes that are limits of it; of two equal fits theirs is named
    # whether a controller that knows of it can reduce its effect on the true position; decided
    # before any controller was run
    compensable: bool = False
    # why a table of settled readings cannot show it; ignored where static.models.TERMS can
    settled: str = "settled readings have no time"

    def __post_init__(self) -> None:
        """Refuse an unknown requirement."""
        if isinstance(self.needs, str):
            raise ValueError(f"needs of {self.name} is {self.needs!r}; give a tuple of words")
        for word in self.needs:
            if word not in NEEDS:
                hint = near(str(word), NEEDS)
                raise ValueError(f"{self.name} needs {word!r}, which no recording has{hint}")

    def title_of(self, form: Form) -> str:
        """Return the title of one of the forms, that of the cause by default."""
        return form.title or self.title

    @property
    def in_valve(self) -> bool:
        """True if all forms act upstream of the pressure, or on its reading."""
        amounts = [t.name for form in self.forms for t in form.terms if t.amount]
        return all(name.startswith(("regulator.", "pressure.")) for name in amounts)
