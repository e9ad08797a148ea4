"""Plants of the papers' figures: independent of the defaults of regulator and hysteresis."""

import pytest

from benchmarks.papers.published import as_published
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.single_muscle.plant import SingleMuscle

PRESETS = (
    AntagonisticJoint.paper,
    ElbowOrthosis.paper,
    KneeOrthosis.rig,
    KneeOrthosis.on_leg,
    SingleMuscle.mas10,
)


@pytest.mark.parametrize("preset", PRESETS, ids=lambda p: p.__qualname__)
def test_regulator_has_neither_dead_time_nor_limited_rate_whatever_its_default(preset) -> None:
    plant = preset(hysteresis="maxwell_slip")
    slow = plant.replace({"regulator.dead_time": 0.045, "regulator.slew_rate": 6.8e5})
    made = as_published(slow)
    assert (made.value("regulator.dead_time"), made.value("regulator.slew_rate")) == (0.0, 1e9)
    assert made.digest() == as_published(plant).digest()


def test_hysteresis_driven_by_length_is_refused() -> None:
    with pytest.raises(ValueError, match="not driven by pressure"):
        as_published(SingleMuscle.mas10("maxwell_slip_length"))
