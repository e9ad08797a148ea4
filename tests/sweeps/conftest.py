"""A Dask cluster of processes, for tests that kill them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.sweeps.dask_processes import DaskProcesses


@pytest.fixture(scope="module")
def dask(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DaskProcesses]:
    """A scheduler and two workers that can import the fakes."""
    with DaskProcesses(tmp_path_factory.mktemp("dask")) as made:
        yield made
