"""Diagnosis of a table of settled readings: error of a load-blind muscle, causes, load law.

A table (:class:`~pam_envs.data.tables.ContractionTable`) contains contractions over pressure cycles
at one or more loads, each with one or more repeats. Stages: audit; noise floor from the repeats;
load-blind model with hysteresis; rival causes one at a time and in pairs, judged on held-out
repeats and loads; load law; pressures with implausible readings.
"""

import math
import time
from typing import Any

from pam_envs.data.tables import ContractionTable
from pam_envs.diagnosis.static.audit import audit_polynomials
from pam_envs.diagnosis.static.cells import cells_of
from pam_envs.diagnosis.static.compare import Study
from pam_envs.diagnosis.static.findings import Findings
from pam_envs.diagnosis.static.report import report

__all__ = ["audit_polynomials", "diagnose_readings"]


def diagnose_readings(table: ContractionTable, *, seed: int = 0) -> dict[str, Any]:
    """Diagnose the error of a load-blind muscle with hysteresis on a table of settled readings.

    The table has any loads, pressures and number of repeats; the same table and ``seed`` of the
    resampling give the same report except ``runtime_s``. It has the ``verdict`` (``adequate``,
    ``named``, ``ambiguous``, ``unexplained`` or ``insufficient``), ``text``, ``causes`` and so on;
    ``readings`` has the ``ladder`` of models, ``pairs``, ``load_laws``, ``set_points`` and the
    ``curves`` of the figures. Keys without meaning for a static table, and unknown values, are
    null. A ValueError says that the table has no reading that could differ from zero.
    """
    start = time.perf_counter()
    cells = cells_of(table)
    if cells.used.sum() < 3 or not (cells.readings[:, cells.used] != 0.0).any():
        raise ValueError(
            f"the table has {int(cells.used.sum())} cells that are not zero by definition; a "
            "diagnosis needs readings at several pressures"
        )
    made = report(Findings(table, Study(cells, seed)), seed)
    return {**_finite(made), "runtime_s": time.perf_counter() - start}


def _finite(value: Any) -> Any:
    """Return a report with None for every number that is not finite."""
    if isinstance(value, dict):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
