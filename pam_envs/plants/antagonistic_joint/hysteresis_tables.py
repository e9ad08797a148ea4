"""The operator of a joint's hysteresis as the rows and tables that the kernels read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.plants.antagonistic_joint.hysteresis import ELEMENTS
from pam_envs.plants.antagonistic_joint.hysteresis_kernels import DEPTH, MODEL_ROWS


def check_operator(operator: Any) -> None:
    """Refuse an operator that the kernels cannot run."""
    if isinstance(operator, PlayOperator):
        if len(operator.thresholds) > ELEMENTS:
            raise ValueError(
                f"hysteresis: {len(operator.thresholds)} plays, and at most {ELEMENTS} are simulated: "
                "identify with fewer"
            )
        if abs(operator.total_slope - 1.0) > 1e-9:
            raise ValueError(
                f"hysteresis: the plays' total slope is {operator.total_slope:g}; it must be 1 (the "
                "input that is felt): divide linear and weights by it"
            )
    elif isinstance(operator, Preisach):
        if operator.start != "virgin" or operator.depth != DEPTH:
            raise ValueError(
                f"hysteresis: a Preisach operator with start {operator.start!r} and depth "
                f"{operator.depth}; a joint needs a virgin one (range -h to h) of depth {DEPTH}"
            )
    elif operator is not None:
        raise ValueError(
            f"hysteresis: a joint takes a PlayOperator, a Preisach operator or None, got {operator!r}"
        )


def plays_of(operator: Any) -> int:
    """Return how many plays an operator has."""
    return len(operator.thresholds) if isinstance(operator, PlayOperator) else 0


def model_rows(operator: Any) -> list[float]:
    """Return thresholds and weights of plays, filled up; of a map half its range."""
    if isinstance(operator, PlayOperator):
        idle = [0.0] * (ELEMENTS - plays_of(operator))
        return [*operator.thresholds, *idle, *operator.weights, *idle]
    half = operator.high if isinstance(operator, Preisach) else 1.0
    return [half, *[0.0] * (MODEL_ROWS - 1)]


def map_tables(operators: Sequence[Any]) -> NDArray[np.float64]:
    """Return the Everett maps, shape (members, n, n); one of zeros where there are none."""
    maps = [np.asarray(o.table, float) for o in operators if isinstance(o, Preisach)]
    return np.ascontiguousarray(maps) if maps else np.zeros((1, 2, 2))
