"""Rollouts, replays and steps of every plant equal the committed hashes."""

import pytest

from pam_envs.kernels.build import COMPILED
from tests.plants import plant_golden


def test_every_record_has_a_hash() -> None:
    assert set(plant_golden.committed()) == set(plant_golden.CASES)


@pytest.mark.skipif(COMPILED, reason="machine code for each case takes minutes")
@pytest.mark.parametrize("name", plant_golden.CASES)
def test_record_equals_its_hash(name: str) -> None:
    assert plant_golden.digest(name) == plant_golden.committed()[name]
