"""Diagnosis of settled readings: what a load-blind muscle gets wrong of a table, and why.

A table (:class:`~pam_envs.data.tables.ContractionTable`) holds contractions over pressure cycles at
one load or several, each repeated once or more. The stages: audit; a floor from the repeats; a
load-blind model with hysteresis; rival causes added one at a time and in pairs, judged on repeats
and loads left out; the law of the load; and pressures at which the readings themselves look wrong.
"""

from __future__ import annotations

import math
import time
from typing import Any

from pam_envs.data.tables import ContractionTable
from pam_envs.diagnosis.static.audit import Curve, audit_polynomials
from pam_envs.diagnosis.static.cells import cells_of
from pam_envs.diagnosis.static.compare import Study
from pam_envs.diagnosis.static.findings import find
from pam_envs.diagnosis.static.report import report

__all__ = ["Curve", "audit_polynomials", "diagnose_readings"]


def diagnose_readings(table: ContractionTable, *, seed: int = 0) -> dict[str, Any]:
    """Say what a load-blind muscle with hysteresis gets wrong of a table, and name the causes.

    Parameters
    ----------
    table : ContractionTable
        Settled readings: any loads, pressures and number of repeats.
    seed : int
        For resampling; the same table and seed give the same report but for ``runtime_s``.

    Returns
    -------
    dict
        The report: ``verdict`` (``adequate``, ``named``, ``ambiguous``, ``unexplained`` or
        ``insufficient``), ``text``, ``causes`` and so on; ``readings`` holds what only tables
        have: the ``ladder`` of models tried, ``pairs``, ``load_laws``, ``set_points`` and the
        ``curves`` to draw. Keys without meaning for a static table are null, and so is what is
        not known.

    Raises
    ------
    ValueError
        If the table has no reading that could differ from zero.
    """
    start = time.perf_counter()
    cells = cells_of(table)
    if cells.used.sum() < 3 or not (cells.readings[:, cells.used] != 0.0).any():
        raise ValueError(
            f"the table has {int(cells.used.sum())} cells that are not zero by definition; a "
            "diagnosis needs readings at several pressures"
        )
    made = report(find(table, Study(cells, seed)), seed)
    return {**_finite(made), "runtime_s": time.perf_counter() - start}


def _finite(value: Any) -> Any:
    """Return a report with None for every number that is not known."""
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
