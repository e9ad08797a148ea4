"""Plants in one batch: compatibility and memory layout."""

from types import SimpleNamespace as Plant

import numpy as np
import pytest

from pam_envs.plants.core.rollout import first_of, in_tiles


def plant(kind: str, substeps: int = 4) -> Plant:
    return Plant(
        hysteresis=Plant(kind=kind), substeps=substeps, load=np.random.default_rng(0).random()
    )


def test_first_of_plants_with_equal_options_is_returned() -> None:
    several = [plant("preisach"), plant("preisach")]
    assert first_of(several, "hysteresis.kind", "substeps") is several[0]


def test_plants_with_differing_options_and_empty_lists_are_refused() -> None:
    with pytest.raises(
        ValueError, match=r"one variant \(hysteresis.kind, substeps\), got .*'preisach', 5"
    ):
        first_of([plant("preisach"), plant("preisach", 5)], "hysteresis.kind", "substeps")
    with pytest.raises(ValueError, match="no plants are given"):
        first_of([], "substeps")


def test_tiles_arrange_sets_by_lane_and_repeat_the_last() -> None:
    sets = np.arange(15.0).reshape(5, 3)
    tiles = in_tiles(sets, 5, 4)
    assert tiles.shape == (2, 3, 4)
    assert tiles.flags.c_contiguous
    np.testing.assert_array_equal(tiles[0].T, sets[:4])
    np.testing.assert_array_equal(tiles[1].T, sets[[4, 4, 4, 4]])
