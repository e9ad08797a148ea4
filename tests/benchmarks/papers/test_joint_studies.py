"""Studies of the joint reproduce the figures of fluidic_muscles, or known ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from baselines.joint.loop import pi_system, pole_cancelling
from baselines.robust.loops import robust_controller
from benchmarks.papers import joint as papers_joint
from benchmarks.papers import joint_loops, joint_plants, plots
from benchmarks.papers import joint_studies as studies
from benchmarks.papers.joint_hysteresis import width_ratio
from benchmarks.papers.joint_studies import Setting, step
from pam_envs.plants.antagonistic_joint.hysteresis import joint_hysteresis
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint


def test_exact_figures_of_the_pi():
    time, output = papers_joint.nominal_step()
    exact = studies.step_figures(time, output)
    assert exact.overshoot == pytest.approx(4.32, abs=0.005)
    assert exact.rise == pytest.approx(0.1321, abs=5e-5)
    assert exact.settling == pytest.approx(0.3666, abs=5e-5)


def test_step_with_hysteresis():
    best, same = step("joint_mfc_mu"), step("joint_pi")
    assert same.rise > 1.2 * best.rise
    assert step("joint_pi_slow").rise > 3.0 * best.rise
    assert best.overshoot - same.overshoot < 2.0
    wrong, plain = step("joint_mfc_mu_wrong"), step("joint_mfc_mu_plain")
    assert best.rise < wrong.rise < plain.rise
    assert best.rise == pytest.approx(0.132, abs=0.002)
    assert wrong.rise == pytest.approx(0.142, abs=0.002)


def test_without_hysteresis_the_inverse_is_of_no_use():
    setting = Setting(width=0.0)
    best, plain = step("joint_mfc_mu", setting), step("joint_mfc_mu_plain", setting)
    assert best.rise == pytest.approx(plain.rise, abs=1e-4)
    assert step("joint_mfc_mu", setting).overshoot == pytest.approx(4.32, abs=0.02)


def test_assumed_hysteresis_has_loops_of_ten_per_cent():
    for amplitude in (10.0 * studies.DEGREE, studies.RANGE):
        assert studies.half_gap(amplitude) == pytest.approx(0.10, abs=0.002)
    hysteresis = studies.assumed_hysteresis()
    assert hysteresis.everett[-1, 0] == pytest.approx(2.0 * studies.RANGE)


def test_inverse_shrinks_the_loop_of_a_joint_with_muscles():
    """On the reduced rig the hysteresis is inverted from itself, which says nothing."""
    assert width_ratio(AntagonisticJoint.paper()) > 5.0


def test_loops_are_looked_at_as_they_were_designed():
    """The bilinear rule undone: what comes out is the law in continuous time."""
    frequency = np.geomspace(0.01, 1e3, 50)
    for name, law in (
        ("joint_pi", pi_system(pole_cancelling())),
        ("joint_mfc_mu", robust_controller("mu")),
        ("joint_mfc_hinf", robust_controller("hinf")),
    ):
        made = joint_loops.law_response(studies.controller(name, studies.ReducedRig()), frequency)
        np.testing.assert_allclose(made, law(1j * frequency), rtol=1e-6)


def test_only_synthesised_loop_is_robust_and_fastest_loop_is_least_robust():
    """Fast on the nominal plant is not robust: model-following gains robustness."""
    table = {row.name: row for row in joint_loops.table()}
    assert set(table) == set(studies.STEPPED)
    robust = {name for name, row in table.items() if row.mu <= 1.0}
    assert robust == {"joint_mfc_mu", "joint_mfc_mu_plain", "joint_mfc_mu_wrong"}
    best, pid, smooth = (table[n] for n in ("joint_mfc_mu", "joint_pid", "joint_pid_smooth"))
    assert min(table.values(), key=lambda row: row.step.rise) is pid
    assert pid.mu == max(row.mu for row in table.values())
    assert pid.sensitivity < smooth.sensitivity < best.sensitivity
    assert pid.step.rise < best.step.rise < smooth.step.rise


def test_without_hysteresis_the_pi_alone_is_as_fast_as_model_following():
    """Hysteresis slows the PI and thereby sets the ratio."""
    setting = Setting(width=0.0)
    pair = [step(name, setting).rise for name in ("joint_pi", "joint_mfc_mu")]
    assert pair[0] < pair[1]


@dataclass(frozen=True)
class PresetRig(studies.ReducedRig):
    """The rig of the studies with the hysteresis of the environment's reduced plant."""

    @property
    def hysteresis(self):
        return joint_hysteresis("preisach", True).operator

    def digest(self):
        return "the rig of the studies with the preset's hysteresis"


@pytest.mark.parametrize("name", ["joint_pi", "joint_mfc_mu"])
def test_through_the_environment_a_step_is_what_it_is_in_the_studies(name):
    """Equal hysteresis in both; the environment quantises the angle with its encoder."""
    rig, size = PresetRig(), 10.0
    reference = size * studies.DEGREE * np.repeat([1.0, 0.0, 1.0], 300)
    angle = studies.run(studies.controller(name, rig), reference, rig).angle
    fine = np.arange(1, 3001) * studies.FINE
    plain = studies.step_figures(fine, angle[6000:] / (size * studies.DEGREE))
    assert joint_plants.plant_step("reduced", name, size, True).rise == pytest.approx(
        plain.rise, rel=0.03
    )


def test_errors_of_a_sine_and_to_the_model():
    error, to_model = studies.tracking_error("joint_mfc_mu")
    assert 19.0 < error < 21.0
    assert to_model < 0.02


def test_picture_shows_every_controller_and_both_loops():
    figure = plots.step_figure()
    steps, loops = figure.axes
    assert [len(ax.get_lines()) for ax in (steps, loops)] == [len(plots.LINES) + 1, 2]
    best = [t.get_text() for t in steps.get_legend().get_texts() if "0.133 s" in t.get_text()]
    assert best == ["model-following, inverse: rise 0.133 s"]
