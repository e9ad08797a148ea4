"""Trajectories equal the committed hashes, for every environment and hysteresis model."""

import os
import platform
import subprocess
import sys

import pytest

from pam_envs.kernels.build import COMPILED
from tests.envs import golden

UNCOMPILED = pytest.mark.skipif(COMPILED, reason="machine code for each case takes minutes")


def test_every_case_has_a_hash() -> None:
    assert {k: set(v) for k, v in golden.committed().items()} == {
        k: set(v) for k, v in golden.CASES.items()
    }


@UNCOMPILED
@pytest.mark.parametrize(
    ("name", "variant"), [(n, v) for n, variants in golden.CASES.items() for v in variants]
)
def test_trajectory_equals_its_hash(name: str, variant: str) -> None:
    assert golden.digest(name, variant) == golden.committed()[name][variant]


@UNCOMPILED
@pytest.mark.skipif(platform.machine() != "x86_64", reason="names a kernel of x86 processors")
def test_hashes_do_not_depend_on_the_processor_that_blas_is_tuned_for() -> None:
    environment = {**os.environ, "OPENBLAS_CORETYPE": "Haswell"}
    command = [sys.executable, "-m", "tests.envs.golden"]
    made = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert made.stdout == ""
