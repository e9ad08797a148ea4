"""Probe of planning: its floor of 2,000 poses per second."""

from __future__ import annotations

import pytest

from benchmarks.speed import planning as speed_planning
from benchmarks.speed import rates
from benchmarks.speed.groups import measure


@pytest.mark.parametrize(("rate", "verdict"), [(1999.0, "MISSED"), (2001.0, "pass"), (3e4, "aim")])
def test_planning_has_a_floor(monkeypatch, rate: float, verdict: str) -> None:
    def timed(subjects, rounds):
        assert subjects["poses"]() == 3 * 2 * 41 * speed_planning.REPEATS
        return {"poses": [rate] * rounds}

    monkeypatch.setattr(speed_planning, "interleaved", timed)
    (found,) = measure(["planning"], rounds=3)
    assert (found.value, found.verdict) == (rate, verdict)
    assert "MISSED" not in rates.table([found]) or rate < 2000.0
