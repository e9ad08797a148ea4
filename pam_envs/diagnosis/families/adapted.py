"""Causes of a single muscle in the parameters of another plant."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import compress
from typing import Any

from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.causes import by_name, catalogue
from pam_envs.diagnosis.fit.starting_values import Grid, grid
from pam_envs.parameters import declarations
from pam_envs.plants.single_muscle.plant import SingleMuscle

HOLDS, SPEEDS = (0.45, 0.7), (0.02, 0.1)
"""Kinetic over breakaway friction, and Stribeck speeds [rad/s], at which a search begins."""


def with_bearing(component: str, breaks: Sequence[float]) -> tuple[Cause, ...]:
    """Return the shipped causes, with stick-slip in the bearing of a component.

    ``breaks`` are the breakaway torques [N m] at which the search begins.
    """
    guide = by_name("stick_slip")
    terms = (
        Term(f"{component}.stick", (breaks[len(breaks) // 4],), scale=breaks[len(breaks) // 4]),
        Term(f"{component}.stick_kinetic", (0.4,), high=0.95, scale=1.0, amount=False),
        Term(f"{component}.stick_speed", (0.05,), high=5.0, log=True, amount=False),
    )
    form = Form("Stribeck", terms, search=grid(tuple(breaks), HOLDS, SPEEDS, best=5))
    bearing = replace(guide, title="stick-slip in the bearing", forms=(form,))
    return (*(c for c in catalogue() if c.name != guide.name), bearing)


def with_correction(
    causes: Sequence[Cause], component: str, orders: Sequence[tuple[int, int]]
) -> tuple[Cause, ...]:
    """Return causes whose static law is the correction of a component.

    ``orders`` are the orders in pressure and strain of its terms.
    """
    law = by_name("static_law")
    (form,) = law.forms
    terms = tuple(replace(form.terms[0], name=f"{component}.map_{p}{e}") for p, e in orders)
    corrected = replace(law, forms=(replace(form, terms=terms),))
    return tuple(corrected if cause.name == law.name else cause for cause in causes)


def with_yielding(causes: Sequence[Cause], component: str = "muscle") -> tuple[Cause, ...]:
    """Return causes whose shape of the loops is friction of the length that yields smoothly.

    For plants whose friction is driven by length anyway; ``component`` is that with the friction,
    whose stiffness may also grow with the pressure.
    """
    shape, drive = by_name("hysteresis_shape"), by_name("hysteresis_drive")
    form = next(form for form in drive.forms if form.name == "yielding")
    terms = [
        replace(term, name=f"{component}.{term.name.partition('.')[2]}") for term in form.terms
    ]
    share = Term(f"{component}.yield_share", (0.0,), scale=0.3, amount=False, prior=2.0)
    made = replace(shape, forms=(replace(form, terms=(*terms, share)),))
    kept = (cause for cause in causes if cause.name != drive.name)
    return tuple(made if cause.name == shape.name else cause for cause in kept)


def adapted(
    causes: Sequence[Cause],
    plant: Any,
    renamed: Mapping[str, str],
    factors: Mapping[tuple[str, str], float],
    titles: Mapping[str, str],
) -> tuple[Cause, ...]:
    """Return causes in the parameters of a plant; those without any are left out.

    Parameters
    ----------
    causes : sequence of Cause
    plant : Plant
        Of another family.
    renamed : mapping of str to str
        Component of a single muscle (``"position"``) to that of the plant.
    factors : mapping of tuple of str to float
        Unit of the muscle's parameter and unit of the plant's to the ratio of usual sizes.
    titles : mapping of str to str
        Titles that differ, by name of the cause.
    """
    made = []
    for cause in causes:
        forms = [_form(form, plant, renamed, factors) for form in cause.forms]
        kept = tuple(form for form in forms if form is not None)
        if not kept:
            continue
        found = replace(cause, forms=kept, title=titles.get(cause.name, cause.title))
        if found.in_valve and "command" not in found.needs and not _of_sensors(found):
            found = replace(found, needs=("command", *found.needs))
        made.append(found)
    return tuple(made)


def _of_sensors(cause: Cause) -> bool:
    amounts = [t.name for form in cause.forms for t in form.terms if t.amount]
    return not any(name.startswith("regulator.") for name in amounts)


def _form(
    form: Form,
    plant: Any,
    renamed: Mapping[str, str],
    factors: Mapping[tuple[str, str], float],
) -> Form | None:
    """Return a form without the terms that a plant lacks; None if no amount is left."""
    terms = [_term(term, plant, renamed, factors) for term in form.terms]
    there = [found is not None for found in terms]
    kept = tuple(found[0] for found in terms if found is not None)
    if not any(term.amount for term in kept):
        return None
    search = form.search
    if isinstance(search, Grid):
        sizes = [found[1] for found in terms if found is not None]
        values = tuple(
            tuple(value * size for value in row)
            for row, size in zip(compress(search.values, there), sizes, strict=True)
        )
        search = replace(search, values=values)
    elif search is not None and not all(there):
        return None
    return replace(form, terms=kept, search=search)


def _term(
    term: Term,
    plant: Any,
    renamed: Mapping[str, str],
    factors: Mapping[tuple[str, str], float],
) -> tuple[Term, float] | None:
    """Return a term in the parameters of a plant, and the factor of its sizes."""
    component, _, entry = term.name.partition(".")
    name = f"{renamed.get(component, component)}.{entry}"
    if name not in plant.names:
        return None
    old, new = unit_of(SingleMuscle(), term.name), unit_of(plant, name)
    size = factors.get((old, new), 1.0) if old != new else 1.0

    def sized(value: float | None) -> float | None:
        return None if value is None else value * size

    return (
        replace(
            term,
            name=name,
            starts=tuple(start * size for start in term.starts),
            low=sized(term.low),
            high=sized(term.high),
            scale=sized(term.scale),
        ),
        size,
    )


def unit_of(plant: Any, name: str) -> str:
    """Return the unit of a parameter; an empty text if the plant lacks it."""
    component, _, entry = name.partition(".")
    found = declarations(getattr(plant, component)) if hasattr(plant, component) else {}
    return found[entry].unit if entry in found else ""
