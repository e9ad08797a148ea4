"""The elbow's metrics, on signals whose scores are known."""

from typing import Any

import numpy as np
import pytest

from benchmarks.scenarios.scenario import available
from benchmarks.scoring import metrics
from benchmarks.scoring.groups.elbow import NEAR
from benchmarks.scoring.groups.elbow import UNITS as ELBOW

PERIOD, N = 0.01, 400
TIME = PERIOD * np.arange(1, N + 1)
WAVE = np.sin(2.0 * np.pi * TIME)


STILL = (
    *("state/torque_clipped", "state/stiffness_clipped", "state/slack", "cost/pressure"),
    *("effort/pressure_travel", "effort/air", "effort/switchings"),
)


def signals(**changes: Any) -> dict[str, np.ndarray]:
    """Return a record in which everything is as it should be."""
    made = {
        "time": TIME,
        "reference": WAVE,
        "output": WAVE.copy(),
        "sensed": WAVE.copy(),
        "state/stiffness": 4.0 + WAVE,
        "state/stiffness_reference": 4.0 + WAVE,
        "state/felt": -WAVE,
        "state/object_torque": -WAVE,
        "state/object": np.full(N, 2.0),
    }
    made |= {name: np.zeros(N) for name in STILL}
    return made | changes


def score(**changes: Any) -> dict[str, float]:
    record = signals(
        **{f"state/{k}" if k in ELBOW or k in OWN else k: v for k, v in changes.items()}
    )
    return metrics.score(record, PERIOD, CONTENT)


CONTENT = {
    "settle_seconds": 0.0,
    "hold_seconds": 0.5,
    "sensed": "sensed",
    "cost_scales": {"cost/pressure": 1e5},
    "metrics": ["elbow"],
}
OWN = ("stiffness", "felt", "object", "slack", "torque_clipped", "stiffness_clipped")


def test_perfect_record_has_zero_error():
    scores = score()
    assert set(scores) == set(metrics.of_track({"metrics": ["elbow"]}))
    assert all(scores[name] == 0.0 for name in (*ELBOW, "rms_error"))


def test_each_metric_responds_to_its_own_error():
    assert score(stiffness=4.5 + WAVE)["stiffness_rms"] == pytest.approx(0.5)
    assert score(stiffness=4.5 + WAVE)["impedance_rms"] == pytest.approx(0.5 * NEAR)
    assert score(output=WAVE + 0.3)["impedance_rms"] == pytest.approx(0.3)
    both = score(output=WAVE + 0.3, stiffness=2.0 + WAVE)
    assert both["impedance_rms"] == pytest.approx(np.hypot(0.3, 2.0 * NEAR))
    assert score(felt=-WAVE + 0.2)["felt_rms"] == pytest.approx(0.2)
    assert score(felt=-WAVE + 0.2)["free_felt_rms"] == pytest.approx(0.2)
    assert np.isnan(score(felt=-WAVE + 0.2, object=np.zeros(N))["free_felt_rms"])
    quarter = np.where(np.arange(N) < N // 4, 2.0, 0.0)
    beyond = score(torque_clipped=-quarter)
    assert beyond["saturated_time"] == 0.25
    assert beyond["torque_clipped"] == pytest.approx(1.0)
    other = score(stiffness_clipped=quarter[::-1])
    assert (other["saturated_time"], other["torque_clipped"]) == (0.25, 0.0)
    assert other["stiffness_clipped"] == pytest.approx(1.0)
    assert score(slack=np.where(quarter > 0.0, 2.0, 0.0))["slack_time"] == 0.25
    coils = np.zeros(N)
    coils[::5] = 1.0
    assert score(**{"effort/switchings": coils})["switchings"] == pytest.approx(20.0)


@pytest.mark.parametrize("name", [n for n in available() if n.startswith("elbow")])
def test_tracks_have_worst_cases_and_columns_for_every_metric(name):
    content = available()[name].content
    expected = set(metrics.of_track(content))
    assert set(content["worst_case"]) == expected
    assert {column for column, *_ in metrics.columns_of(content)} <= expected
    assert metrics.headline_of(content) == "impedance_rms"
