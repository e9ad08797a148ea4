"""Structure of the residual of a static model, and isolability of its causes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.diagnosis.decide.structure import pooled_ljung_box, since
from pam_envs.diagnosis.static.cells import Cells
from pam_envs.diagnosis.static.compare import Model, Study, beyond, slopes
from pam_envs.diagnosis.static.models import Term, predict
from pam_envs.diagnosis.static.search import available

Json = dict[str, Any]

LAGS = 6  # number of lags of the whiteness test
DEGREE = 3  # degree of the flexible model, one polynomial for each load and branch


def whiteness(cells: Cells, model: Model) -> float:
    """Return the p-value of uncorrelated residuals along the paths (Ljung-Box test)."""
    paths = [model.residual[(cells.path == k) & cells.used] for k in np.unique(cells.path)]
    paths = [path for path in paths if len(path) > LAGS]
    return pooled_ljung_box(paths, LAGS) if paths else float("nan")


def explained(values: Array, labels: NDArray[Any]) -> float:
    """Return the adjusted share of variance explained by means of each label, at least 0."""
    _, member = np.unique(labels, return_inverse=True)
    count = np.bincount(member)
    means = np.bincount(member, values) / count
    return _adjusted(float(np.sum((values - means[member]) ** 2)), len(count), values)


def _adjusted(left: float, fitted: int, values: Array) -> float:
    total, free = float(np.sum((values - values.mean()) ** 2)), len(values) - fitted
    if free < 1 or total <= 0.0:
        return 0.0
    return max(0.0, 1.0 - left / free / (total / (len(values) - 1)))


def explained_by_polynomials(cells: Cells, residual: Array) -> float:
    """Return the adjusted share of variance explained by polynomials of each load and branch."""
    left, fitted = 0.0, 0
    for group in range(len(cells.loads)):
        for falling in (False, True):
            here = cells.used & (cells.group == group) & (cells.falling == falling)
            degree = min(DEGREE, len(np.unique(cells.pressure[here])) - 1)
            if degree >= 0:
                x, y = cells.pressure[here], residual[here]
                left += float(np.sum((y - np.polyval(np.polyfit(x, y, degree), x)) ** 2))
                fitted += degree + 1
    return _adjusted(left, fitted, residual[cells.used])


def structure(cells: Cells, model: Model) -> Json:
    """Return the ``residual_structure`` of a model: whiteness and shares of variance."""
    used, residual = cells.used, model.residual[cells.used]
    readings = (cells.readings - cells.mean)[:, used] * cells.millimetres + residual
    number = np.broadcast_to(np.arange(len(readings))[:, None], readings.shape)
    seen = np.isfinite(readings)
    turned = np.ones(len(cells.path), bool)  # reversals and starts of paths
    turned[1:] = (np.diff(cells.path) != 0) | (cells.falling[1:] != cells.falling[:-1])
    r2 = {
        "direction": explained(residual, cells.falling[used]),
        "rate": None,
        "pressure": explained(residual, cells.pressure[used]),
        "load": explained(residual, cells.load[used]),
        "time_since_reversal": explained(residual, since(turned, 1.0)[used]),
        "time": None,
        "temperature": None,
        "cycle": explained(readings[seen], number[seen]),
    }
    contraction = {
        "ljung_box_p": whiteness(cells, model),
        "r2": r2,
        "flexible_r2": explained_by_polynomials(cells, model.residual),
        "peak": None,
    }
    return {"contraction": contraction, "pressure": None}


def isolability(study: Study) -> Json:
    """Return the isolability of small causes after a refit of the base.

    Each cause is added to the base in its best established form at its meaningful size; the part
    that a refit of the base absorbs is removed.
    """
    first = dict[str, Term]()
    for term in available(study):
        first.setdefault(term.cause, term)
    weight, values = study.lanes.weight[0], study.base.fit.values()
    at = predict(study.cells, values)
    columns = np.empty((len(weight), len(first)))
    for i, number in enumerate(term.number for term in first.values()):
        moved = values | {number.name: np.array([[number.neutral + number.size]])}
        columns[:, i] = (predict(study.cells, moved) - at)[0] * weight
    left = beyond(slopes(study, study.base), columns)
    size = np.linalg.norm(left, axis=0)
    absorbed = 1.0 - size / np.maximum(np.linalg.norm(columns, axis=0), 1e-30)
    unit = left / np.maximum(size, 1e-30)
    return {
        "names": list(first),
        "cosine": np.abs(unit.T @ unit).tolist(),
        "absorbed": dict(zip(first, absorbed.tolist(), strict=True)),
    }
