"""Cause of model error: an effect that a plain plant has switched off, and its signature."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pam_envs.wording import near

NEEDS = {
    "contraction": "`contraction_mm`",
    "pressure": "`pressure_bar`",
    "loads": "`load_N` with two loads or more",
    "weighed": "loads with a declared tolerance (`tolerance: {mass.load}` in RIG.yaml)",
    "temperature": "varying `temperature_C`",
    "valve_closed": "a segment with the valve closed (`valve_closed` in RIG.yaml)",
    "rest": "a rested muscle at the start (`cycles_since_rest` in RIG.yaml)",
    "exhaust": "a command that falls by more than 0.5 bar",
}
"""Requirements of a cause on a recording, in words."""


@dataclass(frozen=True)
class Term:
    """A parameter of a form.

    Attributes
    ----------
    name : str
        Dotted name of the plant's parameter.
    starts : tuple of float
        Starting values of fits [SI]; forms with several terms start at the i-th of each.
    low, high : float, optional
        Bounds narrower than those of the parameter's declaration.
    scale : float, optional
        Size of a meaningful change.
    log : bool
        Fitted on a logarithmic scale.
    amount : bool
        Whether the effect vanishes with it; other terms only shape the effect.
    """

    name: str
    starts: tuple[float, ...]
    low: float | None = None
    high: float | None = None
    scale: float | None = None
    log: bool = False
    amount: bool = True


@dataclass(frozen=True)
class Form:
    """One mathematical form of a cause.

    Attributes
    ----------
    name : str
        One or two words.
    terms : tuple of Term
        Its parameters.
    search : callable, optional
        Search for starting values from the base's fit, instead of ``Term.starts``
        (:mod:`pam_envs.diagnosis.fit.starting_values`).
    """

    name: str
    terms: tuple[Term, ...]
    search: Callable[..., Sequence[Sequence[float]]] | None = None

    @property
    def trials(self) -> int:
        """Number of starting points among which the best is selected."""
        own = max(len(t.starts) for t in self.terms)
        return int(getattr(self.search, "trials", own)) if self.search is not None else own


@dataclass(frozen=True)
class Cause:
    """An effect that a plant may lack.

    Attributes
    ----------
    name : str
        Name in the report.
    title : str
        Name in a sentence, "creep of the muscle".
    forms : tuple of Form
        Rival mathematical forms; the best one counts.
    signature : str
        Appearance in a residual.
    neighbours : tuple of str
        Causes with a similar signature.
    experiment : str
        Experiment that separates it from them.
    source : str
        Source of the physics.
    needs : tuple of str
        Requirements on a recording that can decide it: words of :data:`NEEDS`.
    once : bool
        Whether it happens once, so that held-out kinds of segment need not show it.
    sensor : str
        Sensor that would measure it directly.
    contains : tuple of str
        Causes that it contains as a limit: if both fit equally well the simpler one is named.
    compensable : bool
        Whether a controller that knows of it can reduce its effect on the true position; decided
        before any controller was run.
    settled : str
        Why a table of settled readings cannot show it; ignored where such a table can
        (:data:`pam_envs.diagnosis.static.models.TERMS`).
    """

    name: str
    title: str
    forms: tuple[Form, ...]
    signature: str = ""
    neighbours: tuple[str, ...] = ()
    experiment: str = ""
    source: str = ""
    needs: tuple[str, ...] = ()
    once: bool = False
    sensor: str = ""
    contains: tuple[str, ...] = ()
    compensable: bool = False
    settled: str = "settled readings have no time"

    def __post_init__(self) -> None:
        """Refuse an unknown requirement."""
        if isinstance(self.needs, str):
            raise ValueError(f"needs of {self.name} is {self.needs!r}; give a tuple of words")
        for word in self.needs:
            if word not in NEEDS:
                hint = near(str(word), NEEDS)
                raise ValueError(f"{self.name} needs {word!r}, which no recording has{hint}")

    @property
    def in_valve(self) -> bool:
        """True if all forms act upstream of the pressure, or on its reading."""
        amounts = [t.name for form in self.forms for t in form.terms if t.amount]
        return all(name.startswith(("regulator.", "pressure.")) for name in amounts)
