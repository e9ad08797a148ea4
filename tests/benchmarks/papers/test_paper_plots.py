"""Picture of a stride: its section of the record and its annotations."""

import numpy as np
import pytest

from benchmarks.papers.plots import after_switch, cut, reduction, spans, stride_figure

TIME = 0.01 * np.arange(1, 1601)


def record() -> dict[str, np.ndarray]:
    """Return a made-up walk: contacts at 5, 10 and 15 s, 2 s of stance, off by 30 N at a switch."""
    stance = ((TIME % 5.0) < 2.0).astype(float)
    desired = 100.0 + 20.0 * np.sin(TIME)
    off = 30.0 * np.exp(-(TIME % 5.0) / 0.2) * stance
    ones = np.ones_like(TIME)
    return {
        "time": TIME,
        "state/stance": stance,
        "sensor/stance": stance,
        "reference": desired,
        "output": desired - off,
        "state/angle": 1.8 + 0.3 * np.sin(TIME),
        "state/deviation": 0.01 * ones,
        "state/pressure": 2e5 * ones,
        "set_point": 2e5 * ones,
        "effort/extensors_free": 0.5 * ones,
        "effort/extensors": 0.4 * ones,
        "effort/extensors_free_calibrated": 0.5 * ones,
        "effort/extensors_calibrated": 0.3 * ones,
    }


def test_spans_cover_the_set_flags() -> None:
    found = spans(np.array([1.0, 1.0, 0.0, 0.0, 1.0]), 0.5 * np.arange(5))
    assert found == [(0.0, 1.0), (2.0, 2.5)]


def test_time_of_a_cut_starts_at_heel_contact() -> None:
    made = cut(record(), 9.2, 15.4)
    assert made["time"][0] == pytest.approx(-0.8, abs=0.011)
    first = np.flatnonzero(made["state/stance"] > 0.5)[0]
    assert made["time"][first] == 0.0
    assert len({len(values) for values in made.values()}) == 1


def test_stride_picture_shows_error_and_emg_reduction() -> None:
    made = cut(record(), 9.2, 15.4)
    (when, tension), error = after_switch(made)
    assert error == pytest.approx(30.0, abs=2.0)
    assert when == pytest.approx(0.0, abs=0.02)
    assert tension == pytest.approx(made["output"][made["time"] >= 0.0][0], abs=2.0)
    assert reduction(made, "effort/extensors{}") == pytest.approx(-20.0)
    figure = stride_figure([made, made], ["I", "II"], "both")
    texts = [text.get_text() for ax in figure.axes for text in ax.texts]
    assert sum("30 N off" in text or "29 N off" in text for text in texts) == 2
    assert sum("-20 %" in text and "reading A: -40 %" in text for text in texts) == 2
    assert len(figure.axes) == 8
