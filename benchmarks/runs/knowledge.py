"""Model knowledge of a controller in a track: of the true plant, or of a nominal one."""

from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.runs.controllers import Entrant

IGNORANT = ("nothing", "tables")
"""Labels of controllers independent of the model; a test builds them from a different model."""
NOMINAL, TRUE = "nominal model", "true model"
TRAINED = "nominal model, trained on the plant"
"""Label of a policy that was trained on the simulated plant; others know a nominal model."""


def of_plant(entrant: Entrant, controller: Any, model: Any, env: Any) -> dict[str, bool]:
    """Return whether a controller's model is the simulated plant, and whether it was trained on it.

    A policy knows the plants of its training, named on its card; a residual one is built from the
    nominal model as well. ``trained_on_plant`` is true of a policy only where its nominal model is
    another plant, or with drawn plants another than that which they are drawn around. Training with
    parameters drawn in their declared ranges is no such knowledge: the ranges are public, and
    classical controllers may be tuned on drawn plants as well.
    """
    base, card = env.unwrapped, getattr(controller, "card", None)
    plant, drawn = base.plant.digest(), base.setup.drawn
    same = model.digest() == plant
    if is_informed(entrant):
        return {"knows_plant": same or drawn, "trained_on_plant": False}
    if not isinstance(card, Mapping):
        return {"knows_plant": same and not drawn, "trained_on_plant": False}
    varied = bool((card.get("env_kwargs") or {}).get("randomize"))
    met = plant in card.get("plants", [card.get("plant")])
    knows = (entrant.kind == "learned" or same) and met and not varied and not drawn
    return {"knows_plant": knows, "trained_on_plant": met and not same}


def is_informed(entrant: Entrant) -> bool:
    """Return whether a controller is designed from the plant of each episode."""
    return entrant.knowledge == TRUE


def label(claimed: str, cells: Sequence[Mapping[str, Any]]) -> str:
    """Return the label of a controller's knowledge in a track, ``claimed`` by its catalogue."""
    if claimed in IGNORANT:
        return claimed
    if all(cell["knows_plant"] for cell in cells):
        return TRUE
    return TRAINED if any(cell.get("trained_on_plant") for cell in cells) else NOMINAL


def is_ahead(mine: str, other: str) -> bool:
    """Return whether one label means the true plant and the other a nominal model."""
    return mine in (TRUE, TRAINED) and other == NOMINAL
