"""What a controller is built from, tried out and not only claimed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.runs import controllers
from benchmarks.runs.controllers import Entrant

IGNORANT = ("nothing", "tables")
"""Labels of controllers that must not depend on the model."""
NOMINAL, TRUE = "nominal model", "true model"
TRAINED = "nominal model, trained on the plant"
"""Label of a policy that has met, in training, the plant of which others are told another."""
MOVED = 1.01
"""Factor by which a foil's parameters differ."""


def foil(plant: Any) -> Any:
    """Return a plant whose every parameter is a little off, but those that must not move."""
    for name in getattr(plant, "names", ()):
        for factor in (MOVED, 1.0 / MOVED):
            try:
                plant = plant.replace({name: plant.value(name) * factor})
                break
            except (ValueError, TypeError):
                continue  # out of bounds, or bound to another parameter
    return plant


def uses_model(entrant: Entrant, model: Any, env: Any, seed: int | None) -> bool:
    """Return whether a controller comes out otherwise when the model is another one."""
    made = [
        controllers.parameters_digest(controllers.make(entrant, told, env, training_seed=seed))
        for told in (model, foil(model))
    ]
    return made[0] != made[1]


def knows_plant(entrant: Entrant, controller: Any, model: Any, env: Any) -> bool:
    """Return whether all that a controller was told is of the plant that is simulated.

    A policy was told the plants of its training, as its card says; a residual one was built from
    the model as well.
    """
    base = env.unwrapped
    card = getattr(controller, "card", None)
    trained = isinstance(card, Mapping)
    knows = (trained and entrant.kind == "learned") or model.digest() == base.plant.digest()
    if isinstance(card, Mapping):
        varied = (card.get("env_kwargs") or {}).get("randomize")
        told = card.get("plants", [card.get("plant")])
        knows = knows and not varied and base.plant.digest() in told
    return knows and not base.setup.drawn


def trained_on_plant(controller: Any, model: Any, env: Any) -> bool:
    """Return whether a policy was trained on a plant that is simulated and that it is not told.

    On drawn plants that is one whose training drew them, too, or was on their middle where the
    model is another.
    """
    card = getattr(controller, "card", None)
    if not isinstance(card, Mapping):
        return False
    base = env.unwrapped
    varied = (card.get("env_kwargs") or {}).get("randomize")
    met = base.plant.digest() in card.get("plants", [card.get("plant")])
    return bool((varied and base.setup.drawn) or (met and model.digest() != base.plant.digest()))


def label(claimed: str, cells: Sequence[Mapping[str, Any]]) -> str:
    """Return what a controller knows in a track.

    Parameters
    ----------
    claimed : str
        By its catalogue.
    cells : sequence of mapping
        Records with ``knows_plant``, ``trained_on_plant`` and, where it was tried, ``uses_model``.
    """
    if claimed in IGNORANT and not any(cell.get("uses_model") for cell in cells):
        return claimed
    if all(cell["knows_plant"] for cell in cells):
        return TRUE
    return TRAINED if any(cell.get("trained_on_plant") for cell in cells) else NOMINAL


def is_ahead(mine: str, other: str) -> bool:
    """Return whether a label says that one knows the plant of which the other is told another."""
    return mine in (TRUE, TRAINED) and other == NOMINAL
