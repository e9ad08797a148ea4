"""Quantities of a report for its figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pam_envs.diagnosis.figures.traces import CHANNELS

Report = Mapping[str, Any]
MINUS, TIMES = "\N{MINUS SIGN}", "\N{MULTIPLICATION SIGN}"


def value(quantity: Any) -> float | None:
    """Return the value of a quantity, itself if it is a number."""
    found = quantity.get("value") if isinstance(quantity, Mapping) else quantity
    return None if found is None else float(found)


def floor(report: Report, channel: str) -> float | None:
    """Return the noise floor of a channel [mm or bar]."""
    return value((report.get("noise_floor") or {}).get(channel))


def changed(report: Report) -> bool:
    """Return whether the report compares two simulations."""
    after = report.get("error_after")
    return bool(report.get("causes")) or bool(after and after != report.get("error_before"))


def reported(quantities: Mapping[str, Any] | None) -> list[str]:
    """Return the channels in a report."""
    return [c for c in CHANNELS if (quantities or {}).get(c)]


def gain_to_floor(report: Report) -> float | None:
    """Return the gain of a model that leaves only noise, or None if it is unknown."""
    errors = report.get("error_before") or {}
    ratios = [errors[c].get("times_floor") for c in reported(errors)]
    total = sum(2.0 * float(np.log(r)) for r in ratios if r)
    return total if total > 0 else None


def short(text: str, most: int) -> str:
    """Return a text of at most ``most`` characters."""
    return text if len(text) <= most else text[: most - 1] + "…"


def written(number: float) -> str:
    """Return a number with two decimals and a typographic minus."""
    return f"{number:.2f}".replace("-", MINUS) if round(number, 2) else "0.00"
