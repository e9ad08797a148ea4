"""Time limits that grow with the load of the machine."""

import pytest

from sweeps import limits


def measure(monkeypatch: pytest.MonkeyPatch, work: float, load: float) -> None:
    """Give a machine on which the work takes ``work`` reference times, with a load per core."""
    clock = iter([0.0, work * limits.REFERENCE, 1.0, 1.0])
    monkeypatch.setattr(limits, "_measured", [])
    monkeypatch.setattr(limits.time, "perf_counter", lambda: next(clock))
    monkeypatch.setattr(limits.os, "cpu_count", lambda: 4)
    monkeypatch.setattr(limits.os, "getloadavg", lambda: (4 * load, 0.0, 0.0), raising=False)


@pytest.mark.parametrize(
    ("work", "load", "factor"), [(1.0, 0.5, 1.0), (0.1, 0.0, 1.0), (3.0, 2.0, 3.0), (1.0, 4.0, 4.0)]
)
def test_limit_grows_with_slowness_and_load_and_never_shrinks(
    work: float, load: float, factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    measure(monkeypatch, work, load)
    assert limits.scaled(60.0) == pytest.approx(60.0 * factor)
    assert limits.scaled(30.0) == pytest.approx(30.0 * factor)  # not measured again


def test_time_limit_of_this_test_is_scaled(request: pytest.FixtureRequest) -> None:
    if request.config.getoption("timeout") is not None:
        pytest.skip("a time limit is given on the command line")
    marker = request.node.get_closest_marker("timeout")
    assert marker.args[0] >= float(request.config.getini("timeout"))
