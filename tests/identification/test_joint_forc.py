"""First-order curves of a joint: the test for a symmetric Preisach operator."""

import numpy as np
import pytest

from baselines.positioning.nominal import LoadedMuscle
from benchmarks.papers.joint_hysteresis import inhomogeneous, inverse_error
from benchmarks.papers.joint_studies import RANGE, assumed_hysteresis
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.identification.joint_forc import (
    measure_hysteresis,
    measure_joint,
    series_inverse,
    symmetrised,
)
from pam_envs.plants.single_muscle.plant import SingleMuscle


def _rig(model):
    return lambda inputs: model.simulate(inputs)[0]


def test_symmetric_operator_passes_and_is_recovered():
    model = assumed_hysteresis()
    found = measure_joint(_rig(model), RANGE, levels=len(model.table))
    assert found.verdict.startswith("passes")
    assert found.symmetry < 1e-12 and found.congruency < 1e-12 and found.wiping_out < 1e-12
    np.testing.assert_allclose(found.model.everett, model.everett, atol=1e-12)
    assert found.model.start == "virgin"
    assert found.gain == pytest.approx(1.0, abs=1e-12)


def test_single_muscle_fails_the_symmetry():
    muscle = LoadedMuscle(SingleMuscle.mas10("maxwell_slip"), 0.0)

    def rig(pressures):
        state, outputs = muscle.hysteresis.initial(1), []
        for pressure in pressures:
            drive, state = muscle.advance(np.array([pressure]), state)
            outputs.append(float(muscle.contraction_at(drive)[0]))
        return np.array(outputs)

    found = measure_hysteresis(rig, 0.0, 6e5)
    assert not found.symmetric and found.symmetry > 0.1
    assert found.verdict.startswith("fails")
    assert found.model.start == "low"


def test_asymmetric_preisach_operator_fails_the_symmetry_alone():
    weights = assumed_hysteresis().weights * np.linspace(0.5, 1.5, 60)[:, None]
    model = Preisach.from_weights(weights, -RANGE, RANGE)
    found = measure_joint(_rig(model), RANGE)
    assert found.preisach and not found.symmetric
    assert "fails the symmetry" in found.verdict
    made = symmetrised(model)
    np.testing.assert_allclose(made.weights, made.weights[::-1, ::-1].T, atol=1e-15)


def test_output_after_a_nonlinear_curve_is_not_congruent():
    hysteresis = assumed_hysteresis()
    found = measure_joint(lambda u: np.exp(6.0 * hysteresis.simulate(u)[0]), RANGE)
    assert found.congruency > 0.1
    assert found.verdict.startswith("fails as a Preisach operator")


def test_output_with_creep_has_no_wiping_out():
    hysteresis = assumed_hysteresis()

    def rig(inputs):
        outputs = hysteresis.simulate(inputs)[0]
        return outputs + 1e-3 * np.arange(len(outputs))

    assert measure_joint(rig, RANGE).wiping_out > 0.03


@pytest.mark.parametrize("answer", [np.zeros(3), None])
def test_rig_with_wrong_output_is_refused(answer):
    with pytest.raises(ValueError, match="one finite number"):
        measure_joint(lambda u: np.full_like(u, np.nan) if answer is None else answer, RANGE)


def test_recursion_is_exact_and_the_printed_sum_is_not():
    exact, series = inverse_error()
    assert exact < 1e-12
    assert 1e-3 < series < 1e-2


def test_printed_sum_is_exact_up_to_the_first_turn_and_for_plays():
    mild, homogeneous = inhomogeneous(), assumed_hysteresis()
    plays = Preisach.from_weights(homogeneous.weights, -RANGE, RANGE)
    for model, shares in ((mild, (0.2, 0.7, 0.4)), (plays, (0.8, 0.3, 0.6, 0.45, 0.9))):
        outputs = float(model.everett[-1, 0]) * np.array(shares)
        reached = model.simulate(series_inverse(model, outputs))[0]
        np.testing.assert_allclose(reached, outputs, atol=1e-9)
