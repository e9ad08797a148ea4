"""A Dask cluster of processes, for tests that kill them."""

import pytest

from tests.sweeps.dask_processes import DaskProcesses


@pytest.fixture(scope="module")
def dask(tmp_path_factory):
    """A scheduler and two workers that can import the fakes."""
    with DaskProcesses(tmp_path_factory.mktemp("dask")) as made:
        yield made
