"""Memory of previewed samples."""

import numpy as np
import pytest

from baselines.predictive.preview import PreviewMemory


def remembered(stride: float) -> tuple[PreviewMemory, object]:
    """Return a memory of the line 0, 1, 2, ... and its content after 60 periods."""
    memory = PreviewMemory.make(np.array([0, 4, 8]), stride)
    seen = memory.start(np.array([[[0.0, 4.0, 8.0]]]))
    for step in range(60):
        seen = memory.add(seen, np.array([[[0.0, step + 4.0, step + 8.0]]]))
    return memory, seen


@pytest.mark.parametrize("stride", [40.0, 40.4])
def test_stored_samples_are_the_neighbours_of_a_time_beyond_the_preview(stride):
    memory, seen = remembered(stride)
    times = np.array([[66.0, 67.5, 68.3, 95.7, 109.0]])  # known up to 67
    within = memory.within(seen, times)
    assert np.all(within <= 67.0)
    found, known = memory.read(seen, times)
    np.testing.assert_allclose(found[0, 0], within[0], atol=1e-9)
    assert known.all()
    below, _ = memory.read(seen, np.floor(within))
    np.testing.assert_array_equal(below[0, 0], np.floor(within[0]))


def test_unknown_times_stay():
    memory, seen = remembered(np.inf)
    times = np.array([[30.0, 90.0]])
    np.testing.assert_array_equal(memory.within(seen, times), times)


def test_without_preview_the_present_sample_is_remembered():
    memory = PreviewMemory.make(np.array([0]))
    seen = memory.start(np.array([[[5.0]]]))
    for value in (6.0, 7.0, 8.0):
        seen = memory.add(seen, np.array([[[value]]]))
    found, known = memory.read(seen, np.array([[2.0, 9.0]]))
    np.testing.assert_array_equal(found[0, 0], [8.0, 8.0])
    np.testing.assert_array_equal(known[0], [True, False])
