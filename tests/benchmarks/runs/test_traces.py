"""Thinned trajectories: chosen episodes, drawn signals and the resolution of the grid."""

import board_fakes as fakes
import numpy as np
import pytest

from benchmarks.runs import traces
from benchmarks.scenarios.scenario import ScenarioSet


def test_packed_signal_is_restored_within_its_grid_and_keeps_gaps():
    values = np.array([-3.0, np.nan, 0.123456, 7.0])
    packed = traces.pack(values)
    found = traces.unpack(packed)
    assert np.isnan(found).tolist() == [False, True, False, False]
    assert found[[0, 3]] == pytest.approx([-3.0, 7.0], abs=1e-12)
    assert found[2] == pytest.approx(0.123456, abs=0.5 * 10.0 / traces.GRID)
    assert traces.unpack(traces.pack(np.full(3, 2.5))).tolist() == [2.5] * 3
    assert np.isnan(traces.unpack(traces.pack(np.full(2, np.nan)))).all()


def test_one_moving_and_one_resting_reference_are_drawn():
    assert traces.chosen(ScenarioSet(fakes.CONTENT)) == ("sines", "steps")
    only = {**fakes.CONTENT, "grid": {"reference": ["steps"]}}
    assert traces.chosen(ScenarioSet(only)) == ("steps",)


def test_episode_is_thinned_and_loop_is_output_over_pressure():
    made = fakes.trace("pid")
    assert made["pressures"] == ["state/pressure"]
    assert made["loop"] == ["pressure", "output"]
    assert (made["start"], made["step"]) == (pytest.approx(0.01), pytest.approx(0.02))
    output = traces.unpack(made["signals"]["output"])
    assert len(output) == 250
    assert output[10] == pytest.approx(5e-3 + 1e-3 * np.cos(0.21), abs=0.5 * 2e-3 / traces.GRID)


def test_loop_of_antagonistic_pair_is_over_pressure_difference():
    time = np.array([0.01, 0.02])
    signals = {
        "time": time,
        "reference": time,
        "output": time,
        "state/pressure_a": np.array([3e5, 4e5]),
        "state/pressure_b": np.array([2e5, 1e5]),
    }
    made = traces.of_episode("only", 1, signals, {})
    assert made["loop"] == ["pressure difference", "output"]
    assert traces.unpack(made["signals"]["loop/across"]) == pytest.approx([1e5, 3e5])


def test_reference_has_gaps_outside_its_gate():
    time = np.array([0.01, 0.02, 0.03])
    signals = {"time": time, "reference": time, "output": time, "state/stance": np.array([1, 0, 1])}
    made = traces.of_episode("only", 1, signals, {"gate": ["state/stance"]})
    assert np.isnan(traces.unpack(made["signals"]["reference"])).tolist() == [False, True, False]
