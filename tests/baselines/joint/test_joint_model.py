"""Nominal joint model: warning for a hysteresis that is not symmetric."""

from __future__ import annotations

import warnings

import pytest

from baselines.joint.model import joint_model
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint


def test_asymmetric_hysteresis_warns_with_value_and_bound() -> None:
    joint = AntagonisticJoint.paper(muscle__imbalance=0.08)
    with pytest.warns(UserWarning, match=r"fails the symmetry: symmetry 0\.0\d\d \(bound 0.03\)"):
        model = joint_model(joint)
    assert model.hysteresis is not None and model.hysteresis.start == "low"


@pytest.mark.parametrize("preset", ["paper", "measured", "reduced"])
def test_presets_raise_no_warning(preset: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = joint_model(getattr(AntagonisticJoint, preset)())
    assert model.hysteresis is not None and model.hysteresis.start == "virgin"
