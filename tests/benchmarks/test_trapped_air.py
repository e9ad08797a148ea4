"""Figure of trapped air beside the record of shut valves."""

import numpy as np

from benchmarks.trapped_air import CONTRACTION, EXPONENTS, shut_joint, trapped_air_figure


def test_figure_shows_the_record_and_every_exponent():
    panels = trapped_air_figure().axes
    assert len(panels) == 2
    for sign, panel in zip((-1.0, 1.0), panels, strict=True):
        measured, *models = panel.get_lines()
        assert len(measured.get_xdata()) == 7007 and len(models) == len(EXPONENTS)
        rises = [np.diff(line.get_ydata())[0] for line in models]
        assert np.all(np.diff(sign * np.array(rises)) > 0.0)


def test_muscles_of_the_shut_joint_have_the_assumed_contraction():
    plant = shut_joint(1.0)
    found = plant.lever.contraction(0.0, plant.muscle.rest_length)
    np.testing.assert_allclose(found, CONTRACTION, rtol=1e-12)
