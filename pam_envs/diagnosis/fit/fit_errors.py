"""Explanation of a fit that ends in a plant that cannot be simulated."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from pam_envs.plants.single_muscle.plant import UnstableParameters

ADVICE = (
    "the recording cannot be used: no muscle of this size moves as recorded, and the fit ended in "
    "a plant that cannot be simulated; check the units of contraction_mm, pressure_command_bar and "
    "load_N, and rest length, diameter and largest pressure in RIG.yaml"
)


@contextmanager
def fit_failures_explained() -> Iterator[None]:
    """Turn the failure of a fit into an error on the data and RIG.yaml."""
    try:
        yield
    except (UnstableParameters, np.linalg.LinAlgError) as error:
        raise ValueError(ADVICE) from error
