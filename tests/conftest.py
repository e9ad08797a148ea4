"""Settings of all tests."""

import os
from collections.abc import Generator

import pytest

from sweeps.limits import scaled

os.environ.setdefault("PAM_ENVS_COMPILE", "wait")  # tests compare machine code


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Give each test its time limit, scaled with the load of the machine when it begins."""
    marked = item.get_closest_marker("timeout")
    seconds = marked.args[0] if marked else float(item.config.getini("timeout") or 0)
    if seconds and item.config.getoption("timeout") is None:
        item.add_marker(pytest.mark.timeout(scaled(seconds)), append=False)
    return (yield)
