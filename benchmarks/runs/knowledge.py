"""Model knowledge of a controller in a track: of the true plant, or of a nominal one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.runs.controllers import Entrant

IGNORANT = ("nothing", "tables")
"""Labels of controllers that do not depend on the model; a test builds them from another one."""
NOMINAL, TRUE = "nominal model", "true model"
TRAINED = "nominal model, trained on the plant"
"""Label of a policy that was trained on the simulated plant; others know a nominal model."""


def knows_plant(entrant: Entrant, controller: Any, model: Any, env: Any) -> bool:
    """Return whether a controller's model is the simulated plant.

    A policy knows the plants of its training, named on its card; a residual one is built from the
    nominal model as well.
    """
    base = env.unwrapped
    card = getattr(controller, "card", None)
    trained = isinstance(card, Mapping)
    knows = (trained and entrant.kind == "learned") or model.digest() == base.plant.digest()
    if isinstance(card, Mapping):
        varied = (card.get("env_kwargs") or {}).get("randomize")
        trained_on = card.get("plants", [card.get("plant")])
        knows = knows and not varied and base.plant.digest() in trained_on
    return knows and not base.setup.drawn


def trained_on_plant(controller: Any, model: Any, env: Any) -> bool:
    """Return whether a policy was trained on the simulated plant, and its nominal model is another.

    With drawn plants this is a policy whose training drew them as well, or was on the plant that
    they are drawn around where the model is another.
    """
    card = getattr(controller, "card", None)
    if not isinstance(card, Mapping):
        return False
    base = env.unwrapped
    varied = (card.get("env_kwargs") or {}).get("randomize")
    met = base.plant.digest() in card.get("plants", [card.get("plant")])
    return bool((varied and base.setup.drawn) or (met and model.digest() != base.plant.digest()))


def label(claimed: str, cells: Sequence[Mapping[str, Any]]) -> str:
    """Return the label of a controller's knowledge in a track.

    Parameters
    ----------
    claimed : str
        By its catalogue.
    cells : sequence of mapping
        Records with ``knows_plant`` and ``trained_on_plant``.
    """
    if claimed in IGNORANT:
        return claimed
    if all(cell["knows_plant"] for cell in cells):
        return TRUE
    return TRAINED if any(cell.get("trained_on_plant") for cell in cells) else NOMINAL


def is_ahead(mine: str, other: str) -> bool:
    """Return whether one label means the true plant and the other a nominal model."""
    return mine in (TRUE, TRAINED) and other == NOMINAL
